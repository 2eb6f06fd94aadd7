"""Bounds designed from recorded walks."""

from __future__ import annotations

import numpy as np
import pytest
import synthetic

from pdhocbf_drake.barriers import make_bound
from pdhocbf_drake.cli import main
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.robust import nearer_bound
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.run_log import FELL
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.certify.design import design_bound, measured_envelope
from pdhocbf_drake.studies.certify.prediction_errors import prediction_errors
from pdhocbf_drake.walking.quantities import SPEEDS

N, ANGLE = synthetic.N, 2 * np.pi * np.arange(synthetic.N) / synthetic.N
FORMULA = synthetic.SPEED + synthetic.RIPPLE * np.cos(ANGLE)


def walked(noise: float = 0.0, speed: float = 1.0, ending: str = "finished", duration: float = 4.0) -> Run:
    """A run of the template whose velocity follows a formula, times `speed`, plus uniform noise."""
    run = synthetic.run("vhip", duration, ending)
    velocity = run.log.signals["lip_state"][:, 1]
    velocity *= speed
    velocity += np.random.default_rng(0).uniform(-noise, noise, len(velocity))
    return run


def bound_of(config, side="upper"):
    return make_bound(config, N, side=side).samples(0, N)


def test_the_envelope_holds_the_measured_extreme_of_each_phase():
    envelope = measured_envelope(walked(), SPEEDS[0], "upper", 2.0)
    assert envelope.mean == pytest.approx(FORMULA)
    assert envelope.outer == pytest.approx(FORMULA)
    assert envelope.spread < 1e-9
    assert envelope.periods == 5
    noisy = measured_envelope(walked(noise=0.01), SPEEDS[0], "upper", 2.0)
    assert np.all(noisy.outer >= noisy.mean)
    assert 0.0 < noisy.spread < 0.02


@pytest.mark.parametrize("kind", ["tabulated", "harmonic"])
@pytest.mark.parametrize("side", ["upper", "lower"])
def test_everything_measured_keeps_the_margin_and_no_more_than_needed(kind, side):
    run = walked(noise=0.01)
    values = bound_of(design_bound(measured_envelope(run, SPEEDS[0], side, 2.0), 0.02, kind, side), side)
    ticks = np.arange(200, len(run.log))
    distance = values[ticks % N] - run.log.element("lip_state", "vx")[ticks]
    distance = distance if side == "upper" else -distance
    assert distance.min() >= 0.02 - 1e-9
    assert distance.min() <= 0.02 + 1e-4  # rounding outwards


def test_a_harmonic_walk_gets_back_its_harmonic():
    config = design_bound(measured_envelope(walked(), SPEEDS[0], "upper", 2.0), 0.02, "harmonic", "upper")
    assert config.mean == pytest.approx(synthetic.SPEED + 0.02, abs=3e-5)
    assert config.cosine == pytest.approx(synthetic.RIPPLE, abs=3e-5)
    assert config.sine == pytest.approx(0.0, abs=3e-5)


def test_lateral_bounds_have_the_period_of_the_gait():
    assert len(measured_envelope(walked(), SPEEDS[1], "upper", 0.8).outer) == 2 * N


@pytest.mark.parametrize(
    ("run", "message"),
    [
        (walked(ending=FELL), "it fell, and a bound needs a walk that went on to its end"),
        (walked(duration=2.5), "at least 3 steps from 2 s on are needed, given 1"),
        (synthetic.run("van_der_pol"), "a bound is designed from a walk, not from an oscillator"),
    ],
)
def test_a_run_with_too_few_steps_is_refused(run, message):
    with pytest.raises(InputError, match=message):
        measured_envelope(run, SPEEDS[0], "upper", 2.0)


def test_a_margin_below_zero_is_refused():
    envelope = measured_envelope(walked(), SPEEDS[0], "upper", 2.0)
    with pytest.raises(InputError, match="--margin must be 0 or more"):
        design_bound(envelope, -0.01, "tabulated", "upper")


@pytest.mark.parametrize("kind", ["tabulated", "harmonic"])
def test_a_scenario_can_use_the_written_bound(elsewhere, capsys, kind):
    (elsewhere / "run").mkdir()
    walked().save(elsewhere / "run")
    assert main(["design-bound", "run", "--margin", "0.02", "--kind", kind, "--name", "limit"]) == 0
    assert "enforceable, its psi rows too" in capsys.readouterr().out
    text = (elsewhere / "bound-limit.yaml").read_text()
    scenario = load_scenario("vhip_nobarrier", text[text.index("barriers:") :])
    assert bound_of(scenario.barriers["limit"].bound) == pytest.approx(FORMULA + 0.02, abs=6e-5)
    assert load_scenario("bound-limit.yaml").barriers.keys() == {"limit"}


def test_a_bound_that_can_not_be_kept_is_not_written(elsewhere, capsys):
    slow = walked(speed=0.7)
    scenario = slow.scenario.model_copy(
        update={"mpc": slow.scenario.mpc.model_copy(update={"step_tolerance": (0.0, 0.05)})}
    )
    (elsewhere / "run").mkdir()
    Run(scenario, slow.log, slow.provenance).save(elsewhere / "run")
    assert main(["design-bound", "run", "--margin", "0.01"]) == 1
    assert "can't be kept for ever (no state is left at phase" in capsys.readouterr().err
    assert not (elsewhere / "bound-forward_speed.yaml").exists()


def test_a_folder_without_a_run_is_refused_in_one_sentence(elsewhere, capsys):
    assert main(["design-bound", "nothing", "--margin", "0.01"]) == 1
    assert "nothing is not a run folder" in capsys.readouterr().err


def surprised(errors: float, duration: float = 12.0) -> Run:
    """A run whose CoM and velocity differ from those that were planned by normal errors, the velocity's ten times."""
    run = synthetic.run("vhip", duration, "finished")
    random, planned = np.random.default_rng(4), run.log.signals["com_reference"]
    for place, (state, size) in enumerate(((0, 0.1), (1, 1.0), (3, 0.1), (4, 1.0))):
        measured = run.log.signals["lip_state"][:, state]
        planned[:, (0, 1, 3, 4)[place]] = measured - errors * size * random.normal(size=len(measured))
    return run


def test_the_box_of_prediction_errors_holds_their_share_and_grows_with_the_confidence():
    run = surprised(0.001)
    low, high = (prediction_errors(run, share, 2.0).half_widths for share in (0.9, 0.999))
    assert low[0] < high[0] and low[1] < high[1]
    ticks = run.log.time >= 2.0
    error = (run.log.element("lip_state", "vx") - run.log.element("com_reference", "vx"))[ticks]
    assert np.mean(np.abs(error) <= low[1]) >= 0.9
    assert prediction_errors(run, 0.999, 2.0).largest[1] >= np.abs(error).max()
    assert prediction_errors(surprised(0.002), 0.9, 2.0).half_widths[1] == pytest.approx(2 * low[1], abs=2e-6)


def test_margin_and_disturbance_that_belong_together_are_certified_and_written(elsewhere, capsys):
    (elsewhere / "run").mkdir()
    surprised(0.0003).save(elsewhere / "run")
    assert main(["design-bound", "run", "--confidence", "0.99", "--name", "limit"]) == 0
    assert "enforceable under these errors" in capsys.readouterr().out
    scenario = load_scenario("bound-limit.yaml")
    com, velocity = scenario.mpc.robust.disturbance
    assert (com, velocity) == prediction_errors(surprised(0.0003), 0.99, 2.0).half_widths
    # With the same errors in mpc.robust the bound that is enforced is the undisturbed walk.
    walk = build_walk(scenario)
    nearer = nearer_bound(walk.mpc.barriers[0][0], walk.vhip, scenario.mpc)
    assert bound_of(scenario.barriers["limit"].bound) - nearer[:N] == pytest.approx(FORMULA, abs=2e-5)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--confidence", "1"], "--confidence must be above 0 and below 1, given 1"),
        (["--confidence", "0.9", "--from-time", "11"], "at least 3 steps"),
        (["--confidence", "0.999"], "no margin withstands errors of "),
    ],
)
def test_errors_that_give_no_margin_are_refused(elsewhere, capsys, options, message):
    (elsewhere / "run").mkdir()
    surprised(0.004 if "0.999" in options else 0.0003).save(elsewhere / "run")
    assert main(["design-bound", "run", *options]) == 1
    assert message in capsys.readouterr().err
