"""The plan of a walk on sensors is judged, and drawn, from the foot that the robot truly stands on."""

from __future__ import annotations

import numpy as np
import pytest
from logs import differences

from pdhocbf_drake.analysis.heading import along, box_frame, zmp_seen
from pdhocbf_drake.analysis.plan_frame import plan_over_stance, present_over_stance
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.systems.base_estimator import TrueState
from pdhocbf_drake.systems.signals import places, size

PLANNED = {
    "com_reference": ("x", "y"), "zmp_reference": ("x_zmp", "y_zmp"), "stance_plan": ("x_now", "y_now"),
    "foot_reference": ("left_x", "left_y"),
}  # fmt: skip
TICKS, DRIFT = 5, np.array([0.03, -0.02])


def _log(yaw: float | None = None) -> RunLog:
    """Random signals, with an estimate that is the truth."""
    draw = np.random.default_rng(2)
    names = ("lip_state", "foot_state", "estimator_status", "zmp_box", *PLANNED)
    signals = {name: draw.normal(size=(TICKS, size(name))) for name in names}
    signals["estimator_status"][:, places("estimator_status", "held")] = [[0.0], [1.0], [1.0], [0.0], [1.0]]
    signals["foot_estimate"] = signals["foot_state"].copy()
    if yaw is not None:
        signals["path"] = np.zeros((TICKS, size("path")))
        signals["path"][:, places("path", "yaw")] = yaw
    return RunLog(signals, 0.01 * np.arange(TICKS))


def _drifted(log: RunLog) -> RunLog:
    """The same walk in a world of the estimate that has drifted."""
    signals = {name: table.copy() for name, table in log.signals.items()}
    for foot in ("left", "right"):
        signals["foot_estimate"][:, places("foot_estimate", f"{foot}_x", f"{foot}_y")] += DRIFT
    signals["foot_reference"][:, places("foot_reference", "right_x", "right_y")] += DRIFT
    for which in ("last", "next", "after"):
        signals["stance_plan"][:, places("stance_plan", f"x_{which}", f"y_{which}")] += DRIFT
    for name, pair in PLANNED.items():
        signals[name][:, places(name, *pair)] += DRIFT
    seen = np.tile(DRIFT, (TICKS, 1))
    signals["zmp_box"] += np.repeat(along(seen, box_frame(log)[:, 2]) if "path" in log else seen, 2, axis=1)
    return RunLog(signals, log.time)


@pytest.mark.parametrize("yaw", [None, 0.7])
def test_a_drift_of_the_estimated_world_changes_nothing(yaw):
    log = _log(yaw)
    placed, expected = plan_over_stance(_drifted(log)), log
    for name in (*PLANNED, "zmp_box", "lip_state", "foot_state"):
        np.testing.assert_allclose(placed[name], expected[name], atol=1e-12)
    np.testing.assert_array_equal(zmp_seen(placed), zmp_seen(log))
    first = {name: table[1] for name, table in _drifted(log).signals.items()}
    np.testing.assert_allclose(present_over_stance(first)["zmp_reference"], log["zmp_reference"][1], atol=1e-12)


def test_a_log_of_the_true_state_stays_as_it_is():
    log = RunLog({"lip_state": np.zeros((2, 6))}, np.array([0.0, 0.01]))
    assert differences(plan_over_stance(log), log) == []
    assert plan_over_stance(log) is log


@pytest.mark.parametrize(("held", "side"), [(0.0, "left"), (1.0, "right")])
def test_barriers_are_judged_from_the_foot_that_stands(held, side):
    """c and p less the stance foot's place are the same by truth and by `TrueState` with the estimated foot."""
    draw = np.random.default_rng(3)
    lip, feet, estimate = (draw.normal(size=size(name)) for name in ("lip_state", "foot_state", "foot_estimate"))
    status = np.zeros(size("estimator_status"))
    status[places("estimator_status", "held")] = held
    block = TrueState()
    context = block.CreateDefaultContext()
    for port, value in zip(
        ("lip_state", "foot_state", "foot_estimate", "estimator_status"), (lip, feet, estimate, status), strict=True
    ):
        block.GetInputPort(port).FixValue(context, value)
    state, foot = block.GetOutputPort("true_state").Eval(context), places("foot_state", f"{side}_x", f"{side}_y")
    for names in (("x", "y"), ("x_zmp", "y_zmp")):
        part = places("lip_state", *names)
        np.testing.assert_allclose(state[part] - estimate[foot], lip[part] - feet[foot], atol=1e-12)
    velocity = places("lip_state", "vx", "vy")
    np.testing.assert_array_equal(state[velocity], lip[velocity])
