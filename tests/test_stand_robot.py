"""Pushes on a robot that stands, or is about to: it steps where only a step helps, and stands, or walks, again."""

from __future__ import annotations

import numpy as np
import pytest

from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.simulation.run_log import FINISHED, RunLog
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate

GAIT = "com_height_phase: 20"  # highest in mid-stance
COARSE, FINE = "plant: {time_step: 0.005}", "plant: {time_step: 0.001}"


def pushed(time: float, force: tuple[float, float], gait: str, duration: float, plant: str) -> RunLog:
    push = f"{{time: {time}, duration: 0.1, force: [{force[0]}, {force[1]}, 0.0]}}"
    return simulate(load_scenario("walking", f"{{gait: {{{gait}}}, duration: {duration}, pushes: [{push}], {plant}}}"))


@pytest.mark.parametrize("force", [60.0, 80.0, 100.0])
def test_a_recovery_from_a_push_in_the_standing_start_ends(force: float) -> None:
    log = pushed(0.6, (force, 0.0), GAIT, 5.0, FINE)
    reasons = log.element("solver_status", "reason")
    assert log.ending == FINISHED
    assert 0 < np.isin(reasons, (Reason.RECOVERING, Reason.NO_STEADY_PLAN)).sum() <= 200
    speed = log.element("lip_state", "x")[[-81, -1]] @ [-1.0, 1.0] / 0.8
    assert speed == pytest.approx(0.375, abs=0.005)
    assert np.abs(log.element("lip_state", "y")[-80:].mean()) < 0.01


@pytest.mark.parametrize(
    ("time", "force"),
    [
        (2.85, (0.0, 70.0)), (3.0, (120.0, 0.0)), (3.1, (-120.0, 0.0)), (3.4, (120.0, 0.0)), (3.55, (-120.0, 0.0)),
        (3.7, (120.0, 0.0)), (4.1, (0.0, -70.0)), (4.2, (-120.0, 0.0)),
    ],
)  # fmt: skip
def test_a_robot_that_is_to_stand_stands_again_after_a_push(time: float, force: tuple[float, float]) -> None:
    log = pushed(time, force, f"walk_steps: 6, {GAIT}", time + 3.6, COARSE)
    assert log.ending == FINISHED
    assert log.element("gait_phase", "support")[-1] == 0.0
    assert np.abs(log["lip_state"][-40:, [1, 4]].mean(axis=0)).max() < 0.05


def test_a_robot_stands_for_as_long_as_it_is_asked_to() -> None:
    log = simulate(load_scenario("walking", f"{{gait: {{walk_steps: 0}}, duration: 30.0, {COARSE}}}"))
    assert log.ending == FINISHED
    assert not log.element("gait_phase", "support").any()
    assert np.abs(log["lip_state"][:, [0, 3]]).max() < 0.02
    assert set(log.element("solver_status", "reason")) == {Reason.SOLVED}
