"""Barriers that are changed while a walk goes on."""

from __future__ import annotations

import numpy as np
import pytest

from pdhocbf_drake import load_scenario, simulate
from pdhocbf_drake.analysis.barrier_margins import barriers_of, bound_along, h_along, psi_along_log
from pdhocbf_drake.analysis.report import metrics_of
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.loop import walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.run_log import RunLog

NAME = "forward_speed"
CHANGES = """
duration: 5.2
barrier_changes:
  - {time: 3.995, name: forward_speed, kind: none}
  - {time: 2.5, name: forward_speed, kind: constant, margin: 0.02}
  - {time: 3.2, name: forward_speed, kind: periodic, margin: 0.01, gamma: 0.2}
  - {time: 4.5, name: forward_speed, kind: periodic, gamma: [0.9, 0.8]}
"""
PARTS = {(0.0, 2.5): ("orbit", None), (2.5, 3.2): ("orbit_peak", 0.02), (3.2, 4.0): ("orbit", 0.01)}


@pytest.fixture(scope="module")
def log() -> RunLog:
    return simulate(load_scenario("vhip", CHANGES))


def bound_of(kind: str, margin: float | None, log: RunLog) -> np.ndarray:
    own = "{}" if margin is None else f"{{barriers: {{{NAME}: {{bound: {{kind: {kind}, margin: {margin}}}}}}}}}"
    (barrier,) = build_walk(load_scenario("vhip", own)).barriers
    return np.array([barrier.bound(k) for k in range(len(log))])


def test_each_bound_is_that_of_a_scenario_that_has_it(log: RunLog) -> None:
    bound, h, v = log["barrier_bound"][:, 0], log["h"][:, 0], log.element("lip_state", "vx")
    for (start, end), (kind, margin) in PARTS.items():
        rows = (log.time >= start - 1e-9) & (log.time < end - 1e-9)
        np.testing.assert_allclose(bound[rows], bound_of(kind, margin, log)[rows], rtol=1e-12)
    np.testing.assert_allclose(h, bound - v, atol=1e-12)


def test_a_bound_holds_over_the_whole_horizon_from_its_tick_on(log: RunLog) -> None:
    samples = log["barrier_bound"]
    k = round(2.5 / 0.01)
    np.testing.assert_allclose(samples[k], bound_of("orbit_peak", 0.02, log)[0])
    np.testing.assert_allclose(samples[k - 1], bound_of("orbit", None, log)[k - 1 : k - 1 + samples.shape[1]])


def test_both_forms_of_the_controller_agree(log: RunLog) -> None:
    blocks = simulate(load_scenario("vhip", CHANGES), form="blocks")
    for name, table in log.signals.items():
        other = blocks[name]
        if name == "solver_status":
            table, other = np.delete(table, 1, axis=1), np.delete(other, 1, axis=1)
        np.testing.assert_array_equal(table, other, err_msg=name)


def test_what_is_not_kept_is_not_judged(log: RunLog) -> None:
    scenario = load_scenario("vhip", CHANGES)
    use = barriers_of(scenario)[NAME]
    h, bound = h_along(log, scenario, use), bound_along(log, scenario, use)
    none = (log.time > 3.995) & (log.time < 4.5 - 1e-9)
    np.testing.assert_array_equal(np.isnan(h), none)
    np.testing.assert_array_equal(np.isnan(bound), none)
    judged = metrics_of(Run.of(scenario, log, 1.0)).barriers[NAME]
    kept = h[(log.time >= scenario.from_time) & ~none]
    assert judged.h_min == pytest.approx(kept.min())
    assert judged.h_min < 0.1
    assert judged.violations == 0
    psi = psi_along_log(log, use)
    assert np.isnan(psi[248:250]).all()  # h of 2.5 s is that of another bound
    assert np.isfinite(psi[240:248]).all()


def test_a_change_to_what_is_there_changes_nothing() -> None:
    scenario = load_scenario("vhip", "duration: 2.0")
    own = scenario.barriers[NAME]
    change = {"time": 1.2, "name": NAME, "kind": "periodic", "margin": own.bound.margin, "gamma": list(own.gamma)}
    changed = simulate(load_scenario("vhip", f"{{duration: 2.0, barrier_changes: [{change}]}}"))
    plain = simulate(scenario)
    for name in ("lip_state", "barrier_bound", "h"):
        np.testing.assert_array_equal(changed[name], plain[name])


def test_a_plan_keeps_the_gamma_that_is_in_force() -> None:
    """From one memory, the tick after a change plans as a scenario with that γ does."""
    text = "{barriers: {forward_speed: {gamma: [0.15, 0.15]}}}"
    changes = "{barrier_changes: [{time: 2.0, name: forward_speed, gamma: 0.15}]}"
    changed, other = (build_walk(load_scenario("vhip", own)).mpc for own in (changes, text))
    memory = Memory.standing(changed)
    kicks = np.zeros((203, 2))
    kicks[199, 0] = 0.03  # so that the barrier acts
    ticks = [*walk_template(changed, memory, 0, 203, kicks)]
    again = [*walk_template(other, ticks[201].before, 201, 2)]
    np.testing.assert_array_equal(ticks[201].plan.inputs, again[0].plan.inputs)
    before = [*walk_template(other, ticks[199].before, 199, 1, kicks[199:])]
    assert ticks[199].plan.acting.any()
    assert np.abs(ticks[199].plan.inputs - before[0].plan.inputs).max() > 1e-6


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("{time: 1.0, name: other, kind: none}", "must be a barrier of the scenario: forward_speed"),
        ("{time: 1.0, name: forward_speed}", "a kind, a margin or a gamma"),
        ("{time: 1.0, name: forward_speed, kind: often}", "periodic"),
        ("{time: 1.0, name: forward_speed, margin: -0.1}", "margin"),
        ("{time: 1.0, name: forward_speed, margin: .nan}", "margin"),
        ("{time: -1.0, name: forward_speed, kind: none}", "time"),
        ("{time: 1.0, name: forward_speed, gamma: 0.0}", "gamma"),
        ("{time: 1.0, name: forward_speed, gamma: [0.1, 0.2, 0.3]}", "one number, or 2 of them"),
    ],
)
def test_a_wrong_change_is_named(change: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        build_walk(load_scenario("vhip", f"barrier_changes: [{change}]"))


def test_a_margin_is_one_from_an_orbit() -> None:
    text = "{barriers: {forward_speed: {bound: {kind: constant, value: 0.6, margin: null}}}, barrier_changes: [%s]}"
    with pytest.raises(InputError, match="follows no orbit"):
        build_walk(load_scenario("vhip", text % "{time: 1.0, name: forward_speed, margin: 0.1}"))
    build_walk(load_scenario("vhip", text % "{time: 1.0, name: forward_speed, kind: periodic, margin: 0.1}"))


def test_the_oscillator_has_no_such_key() -> None:
    from pdhocbf_drake.simulation.checks import unused_settings

    scenario = load_scenario("van_der_pol", "barrier_changes: [{time: 1.0, name: x, kind: none}]")
    assert "barrier_changes" in unused_settings(scenario)
