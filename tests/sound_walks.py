"""What a walk straight ahead with nothing edited has to keep, whichever robot walks it."""

from __future__ import annotations

import math

from pdhocbf_drake.analysis.metrics_schema import Metrics
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.scenario import Scenario


def check_sound(found: Metrics) -> None:
    """No fall, the commanded way on its path, within soles, limits and bounds, and every tick planned as asked for."""
    assert not found.fell
    assert found.distance is not None
    assert found.distance_commanded is not None
    assert found.distance > 0.95 * found.distance_commanded
    assert found.lateral_drift is not None
    assert found.lateral_drift < 0.02 * found.distance
    assert found.yaw_drift_deg is not None
    assert found.yaw_drift_deg < 0.5  # some bases lie on their side
    assert found.zmp_outside_fraction is not None
    assert found.zmp_outside_fraction < 0.08
    assert found.torque_limit_hits == 0
    assert found.joint_speed_margin_min is not None
    assert found.joint_speed_margin_min > 0.0
    assert found.sole_gap_min is not None
    assert found.sole_gap_min > 0.0
    assert found.mpc is not None
    assert (found.mpc.fallbacks, found.mpc.degraded) == (0, {})
    h_min = found.barriers["forward_speed"].h_min
    assert h_min is not None
    assert h_min >= 0.0


OTHER_WALKS = ("stride 0", "stride 1.3", "turn", *(f"push {way} {part}/4" for way in "xy" for part in range(4)))


def other_walk(scenario: Scenario, name: str) -> dict[str, object]:
    """Overrides of a walk of some steps: another stride, a turn of 0.3 rad/s, or a push at a phase of a step.

    The push is 0.12 m √(g h) for 0.1 s forward, or half of it sideways.
    """
    gait = scenario.gait
    step = gait.ticks_per_step * gait.tick
    kind, _, which = name.partition(" ")
    duration = {"duration": (gait.start_steps + 12) * step}
    if kind == "stride":
        return duration | {"gait": {"stride": float(which) * gait.stride}}
    if kind == "turn":
        return duration | {"commands": [{"time": 0.0, "velocity": [gait.stride / step, 0.0], "turn": 0.3}]}
    way, _, part = which.partition(" ")
    force = 0.12 * Biped.load(scenario.robot).mass * math.sqrt(9.81 * gait.com_height) / 0.1
    time = (gait.start_steps + 4 + int(part[0]) / 4.0) * step
    along = [force, 0.0, 0.0] if way == "x" else [0.0, 0.5 * force, 0.0]
    return duration | {"pushes": [{"time": time, "duration": 0.1, "force": along}]}


def check_walked(found: Metrics, name: str) -> None:
    """No fall and no fallback; unless it was pushed, the commanded way and no torque or speed at a limit."""
    assert not found.fell
    assert found.mpc is not None
    assert found.mpc.fallbacks == 0
    if not name.startswith("push"):
        assert found.distance is not None
        assert found.distance_commanded is not None
        assert found.distance > 0.95 * found.distance_commanded - 0.01
        assert found.torque_limit_hits == 0
