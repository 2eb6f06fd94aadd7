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
from pdhocbf_drake.simulation.commands import commanded_gait
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.run_log import FELL
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.certify.design import design_bound, measured_envelope
from pdhocbf_drake.studies.certify.prediction_errors import prediction_errors
from pdhocbf_drake.walking.barrier_config import WalkBarrierConfig, WalkBoundConfig
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


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--margin", "-0.01"], "--margin must be a finite number from 0 on, given -0.01"),
        (["--margin", "nan"], "--margin must be a finite number from 0 on, given nan"),
        (["--confidence", "1"], "--confidence must be above 0 and below 1, given 1"),
    ],
)
def test_wrong_options_are_refused_before_the_run_is_read(elsewhere, capsys, options, message):
    assert main(["design-bound", "nothing", *options]) == 1
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("kind", ["tabulated", "harmonic"])
def test_a_scenario_can_use_the_written_bound(elsewhere, capsys, kind):
    (elsewhere / "run").mkdir()
    run, packaged = walked(), kind == "harmonic"
    measurement = {"delay_ticks": 2}
    data = run.scenario.to_dict() | {"name": "vhip" if packaged else "mine", "measurement": measurement}
    recorded = run.scenario.from_dict(data, "recorded")
    run._replace(scenario=recorded).save(elsewhere / "run")
    assert main(["design-bound", "run", "--margin", "0.02", "--kind", kind, "--name", "limit"]) == 0
    assert "enforceable, its psi rows too" in capsys.readouterr().out
    text = (elsewhere / "bound-limit.yaml").read_text()
    assert ("extends: vhip" in text) == packaged
    scenario = load_scenario("vhip_nobarrier", text[text.index("barriers:") :])
    assert bound_of(scenario.barriers["limit"].bound) == pytest.approx(FORMULA + 0.02, abs=6e-5)
    mine = load_scenario("bound-limit.yaml")  # it walks as the recorded one did
    assert (mine.system, mine.gait, mine.mpc, mine.measurement) == (
        recorded.system, recorded.gait, recorded.mpc, recorded.measurement
    )  # fmt: skip
    assert mine.barriers.keys() == {"limit", *(["forward_speed"] if packaged else [])}


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


def surprised(errors: float, duration: float = 12.0, landing: float = 1.0, late: int = 0, missed: float = 0.0) -> Run:
    """A run of the template that each tick disturbs by normal errors, the velocity's ten times those of the CoM.

    Args:
        errors: standard deviation of the velocity's [m/s].
        landing: by how much those of the tick after a touchdown are larger [1].
        late: the age of what is measured [ticks].
        missed: by how much the controller has the velocity too low along x [m/s].
    """
    run = synthetic.run("vhip", duration, "finished")
    log, random, tick = run.log, np.random.default_rng(4), synthetic.TICK
    eta = commanded_gait(run.scenario).height.eta()
    factor = np.where(np.arange(len(log)) % N == 0, landing, 1.0)
    true, planned, zmp = (log.signals[name] for name in ("lip_state", "com_reference", "zmp_reference"))
    for axis in (0, 1):
        com, velocity = true[:, 3 * axis].copy(), true[:, 3 * axis + 1].copy()
        off = errors * factor * random.normal(size=(2, len(log)))
        for k in range(len(log) - 1):
            com[k + 1] = com[k] + tick * velocity[k] + 0.1 * off[0, k]
        pull = tick * eta[np.arange(len(log)) % N]
        zmp[:-1, 2 * axis] = com[:-1] - (velocity[1:] - off[1, :-1] - velocity[:-1]) / pull[:-1]
        true[:, 3 * axis] = com
        com, velocity = com.copy(), velocity - missed * (axis == 0)
        for i in range(late + 1):  # what was measured of k is carried forward to k + late, and then to the next tick
            now = slice(i, len(log) - late - 1 + i)
            c, v = com[now].copy(), velocity[now].copy()
            com[now.start + 1 : now.stop + 1] = c + tick * v
            velocity[now.start + 1 : now.stop + 1] = v + pull[now] * (c - zmp[now, 2 * axis])
        planned[:, 3 * axis], planned[:, 3 * axis + 1] = com, velocity
    if late:
        mpc = run.scenario.mpc.model_copy(update={"delay": late})
        run = run._replace(scenario=run.scenario.model_copy(update={"mpc": mpc}))
    return run


@pytest.mark.parametrize("late", [0, 1, 3])
def test_boxes_hold_the_disturbances_of_their_tick_whatever_the_delay(late):
    found = prediction_errors(surprised(0.001, 40.0, 5.0, late, 0.002), 0.9, 2.0)
    assert found.boxes.shape == (2, N, 2)
    # 1.645 standard deviations hold 90 % of normal errors, of each tick and axis by itself.
    expected = 1.645e-3 * np.where(np.arange(N) == 0, 5.0, 1.0)[:, None] * [0.1, 1.0]
    assert np.median(found.boxes[:, 1:] / expected[1:]) == pytest.approx(1.0, abs=0.1)
    assert found.boxes[:, 0] / expected[0] == pytest.approx(1.0, abs=0.4)
    assert found.estimate == pytest.approx((0.0, 0.002), abs=2e-6)
    assert found.robust.innovations


def test_boxes_grow_with_the_confidence_and_in_proportion_to_the_errors():
    run = surprised(0.001)
    low, high = (prediction_errors(run, share, 2.0) for share in (0.9, 0.999))
    assert np.all(low.boxes < high.boxes)
    assert low.estimate == (0.0, 0.0)
    assert low.widest[1] < low.largest[1]
    assert prediction_errors(surprised(0.002), 0.9, 2.0).boxes == pytest.approx(2.0 * low.boxes, abs=2e-6)


def test_margin_and_disturbance_that_belong_together_are_certified_and_written(elsewhere, capsys):
    (elsewhere / "run").mkdir()
    surprised(0.0003).save(elsewhere / "run")
    assert main(["design-bound", "run", "--confidence", "0.99", "--name", "limit"]) == 0
    assert "enforceable under these errors" in capsys.readouterr().out
    scenario = load_scenario("bound-limit.yaml")
    assert scenario.mpc.robust == prediction_errors(surprised(0.0003), 0.99, 2.0).robust
    # With the same errors in mpc.robust the bound that is enforced leaves both the recorded and the planned walk alone.
    walk = build_walk(scenario)
    nearer = nearer_bound(walk.mpc.barriers[0][0], walk.vhip, scenario.mpc, 0)
    orbit = {"orbit": WalkBarrierConfig(bound=WalkBoundConfig(kind="orbit"))}
    planned = build_walk(scenario.model_copy(update={"barriers": orbit})).mpc.barriers[0][0].bound.samples(0, N)
    undisturbed = np.maximum(FORMULA, planned)
    room = bound_of(scenario.barriers["limit"].bound) - nearer[:N] - undisturbed
    assert room.min() > -1e-9
    assert room.max() < 4.0 * 0.0003  # of the normal errors by which plans were off


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--confidence", "0.9", "--from-time", "11"], "at least 3 steps"),
        (["--confidence", "0.999"], "no margin withstands errors of "),
    ],
)
def test_errors_that_give_no_margin_are_refused(elsewhere, capsys, options, message):
    (elsewhere / "run").mkdir()
    surprised(0.004 if "0.999" in options else 0.0003).save(elsewhere / "run")
    assert main(["design-bound", "run", *options]) == 1
    assert message in capsys.readouterr().err
