"""At which ticks a plan was at a bound that a robot's joints, legs and feet leave to it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.analysis.heading import along
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario

Array = NDArray[np.float64]
Rows = NDArray[np.bool_]

_NEAR = 5e-4  # [m]: a ZMP or a foothold this close to a bound is at it
_SAME = 1e-6  # [m]
_DISTURBED = (Reason.RECOVERING, Reason.NO_STEADY_PLAN)


def at_plan_limits(scenario: Scenario, log: RunLog) -> dict[str, Rows]:
    """Whether the plan of each row is at each bound of `mpc.limits`, or at the least width of a step, (T,) by name.

    With one foot on the ground: `zmp_behind`, `zmp_ahead`, `zmp_inward`, `zmp_outward`, the planned ZMP of all links is
    as far from the sole's centre as that; `step_reach_x`, `step_reach_y`, the next foothold is as far away as a step
    may be; `stance_width_min`, it is as close aside. `stride`: the walk has the stride that was granted to it, which is
    less than what was asked. Where hips or knees limit the ZMP of a disturbed walk, `zmp_held`: it is at that limit.
    Empty without such limits.
    """
    limits = scenario.mpc.plan_limits
    if limits is None or "whole_body_zmp" not in log:
        return {}
    support, (step_x, step_y) = log.element("gait_phase", "support"), _next_step(log).T
    single = _on_one_foot(log, scenario.gait.double_support_ticks)
    ahead, outward = _seen_from_stance(log, log["whole_body_zmp"] - log["stance_plan"][:, 2:4]).T
    outward = support * outward
    reach, least = _step_bounds(scenario, log)
    steps, held = single & _has_next_foot(log), {}
    if limits.zmp_held:
        low, high = np.array(limits.zmp_held)[log.element("gait_phase", "tick").astype(int)].T
        held["zmp_held"] = single & _is_disturbed(log) & ((ahead <= low + _NEAR) | (ahead >= high - _NEAR))
    return {
        "zmp_behind": single & (ahead <= _NEAR - limits.zmp_behind),
        "zmp_ahead": single & (ahead >= limits.zmp_ahead - _NEAR),
        "zmp_inward": single & (outward <= _NEAR - limits.zmp_inward),
        "zmp_outward": single & (outward >= limits.zmp_outward - _NEAR),
        "step_reach_x": steps & (np.abs(step_x) >= reach[:, 0] - _NEAR),
        "step_reach_y": steps & (np.abs(step_y) >= reach[:, 1] - _NEAR),
        "stance_width_min": steps & (-support * step_y <= least + _NEAR),
        "stride": _granted(scenario, log, limits.stride) & (support != 0.0),
        **held,
    }


def _is_disturbed(log: RunLog) -> Rows:
    return np.isin(log.element("solver_status", "reason"), _DISTURBED)


def _on_one_foot(log: RunLog, double_support: int) -> Rows:
    tick, _, support = log["gait_phase"].T
    return np.asarray((support != 0.0) & (tick >= double_support))


def _seen_from_stance(log: RunLog, vectors: Array) -> Array:
    """Vectors (T, 2) of the world along the axes of the commanded stance foot."""
    if "turn_reference" not in log:
        return vectors
    left = log.element("gait_phase", "support") > 0.0
    yaw = np.where(left, log.element("turn_reference", "left_yaw"), log.element("turn_reference", "right_yaw"))
    return along(vectors, yaw)


def _next_step(log: RunLog) -> Array:
    """From the stance foot to the next foothold as planned, (T, 2) [m]."""
    return _seen_from_stance(log, log["stance_plan"][:, 4:6] - log["stance_plan"][:, 2:4])


def _has_next_foot(log: RunLog) -> Rows:
    """Whether a step on one foot follows that of each row; the last step of a log counts as if it did."""
    step, support = log.element("gait_phase", "step"), log.element("gait_phase", "support")
    stands = set(step[support == 0.0].tolist())
    return np.array([value + 1.0 not in stands for value in step.tolist()], dtype=bool)


def _step_bounds(scenario: Scenario, log: RunLog) -> tuple[Array, Array]:
    """Farthest reach (T, 2) and least width (T,) of a step at each row [m]."""
    mpc, limits = scenario.mpc, scenario.mpc.plan_limits
    assert limits is not None
    disturbed = _is_disturbed(log)
    steady = np.full(2, np.inf) if mpc.step_reach is None else np.array(mpc.step_reach)
    reach, least = np.minimum(steady, limits.step_reach), mpc.stance_width_min
    if mpc.recovery is None:
        return np.broadcast_to(reach, (len(log), 2)), np.full(len(log), least)
    other = np.minimum(mpc.recovery.step_reach, limits.step_reach)
    return np.where(disturbed[:, None], other, reach), np.where(disturbed, mpc.recovery.stance_width_min, least)


def _granted(scenario: Scenario, log: RunLog, stride: float | None) -> Rows:
    """Whether the stride that was granted to a walk is the one that is walked, (T,)."""
    if stride is None or "path" not in log:
        return np.full(len(log), stride is not None)
    duration = scenario.gait.ticks_per_step * scenario.gait.tick
    asked, granted = log.element("command_asked", "forward"), log.element("path", "forward")
    return np.asarray((np.abs(granted) >= stride / duration - _SAME) & (np.abs(asked) > np.abs(granted)))
