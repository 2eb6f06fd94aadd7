"""The closed loop: one tick of the controller, and the template walked by it tick after tick.

The block of the diagram, the nominal orbit, the studies and the tests all run `control`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.late_landing import expected, moved_back
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.plan import Plan, Reason
from pdhocbf_drake.mpc.prediction import carried_back
from pdhocbf_drake.mpc.stepping import about_to_stand, steps_again

_LATE = 5.0  # [ticks]: a foot that comes to the ground later is a disturbance


class Measurement(NamedTuple):
    """What is measured at tick k.

    Attributes:
        tick: k.
        state: c, v, p of x, then of y, shape (2, 3) [m, m/s, m], as they were `mpc.delay` ticks ago; p is read only if
            `mpc.zmp_state` is "measured".
        feet: centres and headings of the left and right sole, shape (2, 3) [m, rad]; a foot that lands is put where it
            is measured. None leaves feet where they are planned.
        zmp_offset: expected real minus template ZMP at k + 1 … k + H per axis, shape (2, H) [m]; None is zero.
        bounds: V̄(k) … V̄(k + H) of each barrier by name, shape (H + 1,); None takes the barriers' own.
        command: in place of the scenario's commands: velocity ahead and to the left [m/s], turn rate [rad/s], and 1 for
            a stop or 0, shape (4,); where one of them is not finite, the last such command holds on, and in the last
            eighth of a step only a stop is read. None leaves the scenario's own.
        landing_delay: by how much the stance foot has come to the ground late, see `late_landing` [ticks].
    """

    tick: int
    state: np.ndarray
    feet: np.ndarray | None = None
    zmp_offset: np.ndarray | None = None
    bounds: Mapping[str, np.ndarray] | None = None
    command: np.ndarray | None = None
    landing_delay: float = 0.0


def control(mpc: PeriodicMpc, memory: Memory, measurement: Measurement, latency: float = 0.0) -> tuple[Memory, Plan]:
    """One tick of the controller: from what it remembers and what is measured to its plan and its next memory.

    It puts a foot that lands where it is measured, lets a disturbed walk go on from there and keep its heading, rejects
    a measurement that can't be right, carries a late one forward, filters a noisy one, notices a disturbance, plans,
    brings a walk that stays degraded to a stand, takes up the command of a step that begins, and moves the memory on to
    the next tick. It never raises for what is measured, and changes none of its arguments.

    Args:
        mpc: the compiled problem.
        memory: as this function gave it at the tick before, or `Memory.at_start`.
        measurement: of this tick.
        latency: from a measurement to the effect of what is planned from it [s].

    Returns:
        The memory for the next tick, and the plan; its reason says also what was wrong with the measurement.
    """
    memory, tick = memory.copy(), measurement.tick
    own = mpc.in_force(tick).on(tick)
    mpc = memory.problem(own)
    late = measurement.command is not None and not np.all(np.isfinite(measurement.command))
    if measurement.command is not None and not late:
        memory.read(mpc, tick, measurement.command)
    if measurement.feet is not None:
        memory.land(mpc, tick, measurement.feet)
    if memory.replan(mpc, tick, measurement.feet):
        mpc = memory.problem(own)
    bounds = mpc.bounds(tick) if measurement.bounds is None else measurement.bounds
    state, fault, memory.measured, memory.beliefs = mpc.believer.state(
        memory.beliefs, memory.state, measurement.state, memory.measured, tick, latency, memory.disturbance.active
    )
    if fault == Reason.SOLVED:
        memory.notice(mpc, tick, state)
    if measurement.landing_delay > _LATE and mpc.recovery is not None:
        memory.disturbance = memory.disturbance._replace(active=True, quiet=0)
    if memory.hold(mpc, tick):
        mpc = memory.problem(own)
    offset = mpc.believer.zmp_offset(memory.beliefs, tick, measurement.zmp_offset)
    behind = None
    if measurement.landing_delay > 0.0:
        offset, behind = expected(mpc, tick, memory.stance, measurement.landing_delay, offset)
    plan = _planned(mpc, memory, tick, state, bounds, offset)
    resumed = steps_again(mpc, state, memory.stance[:, 1], plan)
    if resumed != memory.resumed:
        mpc = memory.resume(mpc, tick, resumed)
        plan = mpc.solve(tick, state, memory.stance, bounds, offset, memory.plan, True)
    reason = _supervise(mpc, memory, plan, fault)
    if late and reason == Reason.SOLVED:
        reason = Reason.LATE_COMMAND
    memory.take_up(memory.problem(own), tick)
    memory.advance(mpc, state, plan, memory.problem(own))
    if behind is not None:
        memory.zmp_box = moved_back(mpc, tick, memory.zmp_box, behind)
    memory.beliefs, memory.com_reference, memory.zmp_reference = mpc.believer.sent(
        memory.beliefs, plan, memory.com_reference, memory.zmp_reference
    )
    solved = float(plan.reason.planned)
    cost = plan.cost if solved else 0.0
    memory.solver_status = np.array([solved, 0.0, cost, plan.slack, float(plan.fallbacks), float(reason)])
    memory.barrier_slack, memory.barrier_active, memory.unmet = plan.slacks, plan.acting, plan.unmet.ravel()
    return memory, plan if reason == plan.reason else plan._replace(reason=reason)


class TemplateTick(NamedTuple):
    """One tick of the template under the controller.

    Attributes:
        tick: k.
        state: c, v, p of x, then of y at k, shape (2, 3) [m, m/s, m].
        before: the controller's memory before its update at k.
        plan: the plan made at k.
        memory: the controller's memory after it.
    """

    tick: int
    state: np.ndarray
    before: Memory
    plan: Plan
    memory: Memory


def walk_template(
    mpc: PeriodicMpc,
    memory: Memory,
    first: int,
    ticks: int,
    kicks: np.ndarray | None = None,
    sensor: Callable[[Measurement], Measurement] | None = None,
    disturbance: Callable[[int, np.ndarray, Memory, Plan], np.ndarray] | None = None,
) -> Iterator[TemplateTick]:
    """Walks the template (23) from what `memory` predicts for tick `first`, under `control`.

    Measurements are late by the controller's own delay; those of before the first tick follow from what was sent. The
    ZMP lags as the controller expects it to.

    Args:
        mpc: the compiled problem.
        memory: the controller's memory before tick `first`; it stays as it is.
        first: the first tick.
        ticks: how many.
        kicks: velocity that a disturbance adds before each tick, in x and y, shape (≤ ticks, 2) [m/s].
        sensor: what the controller is given for what is true (or was, where it is late); None gives it that.
        disturbance: what it adds to [c, v](k + 1) of x and y, shape (2, 2) [m, m/s], given k + 1, the state there
            without it, the controller's memory for it, and the plan made at k; None adds nothing.
    """
    state = memory.state
    late = deque(carried_back(mpc.vhip, first, memory.beliefs.sent, state), maxlen=mpc.config.delay_ticks + 1)
    for k in range(first, first + ticks):
        if kicks is not None and k - first < len(kicks):
            state = state.copy()
            state[:, 1] += kicks[k - first]
        late.append(state)
        measured = Measurement(k, late[0])
        following, plan = control(mpc, memory, measured if sensor is None else sensor(measured))
        yield TemplateTick(k, state, memory, plan, following)
        velocity = mpc.believer.zmp_velocity(state, following.zmp_reference)
        memory, state = following, mpc.vhip.step_axes(k, state, velocity)
        if disturbance is not None:
            state = state.copy()
            state[:, :2] += disturbance(k + 1, state, memory, plan)


def _planned(
    mpc: PeriodicMpc, memory: Memory, tick: int, state: np.ndarray, bounds: Mapping[str, np.ndarray],
    offset: np.ndarray | None,
) -> Plan:  # fmt: skip
    """The plan of a steady or of a disturbed walk; where the former is as good as undisturbed, it ends a recovery."""
    config, disturbance = mpc.config.recovery, memory.disturbance
    if config is None or not disturbance.may_be_over(config) or about_to_stand(mpc, tick):
        return mpc.solve(tick, state, memory.stance, bounds, offset, memory.plan, disturbance.active)
    plan = mpc.solve(tick, state, memory.stance, bounds, offset, memory.plan)
    if plan.recovering:
        return plan._replace(reason=Reason.RECOVERING) if plan.reason == Reason.NO_STEADY_PLAN else plan
    if memory.moved(mpc, plan) > config.calm:
        return mpc.solve(tick, state, memory.stance, bounds, offset, memory.plan, True)
    memory.disturbance, memory.beliefs = disturbance.ended(), memory.beliefs.trusted()
    return plan


def _supervise(mpc: PeriodicMpc, memory: Memory, plan: Plan, measurement: Reason) -> Reason:
    """Counts degraded ticks, ends the walk after `mpc.stop_ticks` of them, and gives the reason to log for this tick.

    The stop takes one more step, then sets the feet side by side: `memory.last_step` is read by clock and gait.
    """
    degraded = not plan.reason.planned or measurement != Reason.SOLVED
    memory.degraded = memory.degraded + 1 if degraded else 0
    if memory.degraded >= mpc.config.stop_ticks and memory.last_step < 0:
        memory.last_step = mpc.gait.phase(plan.tick)[0] + 1
    if not plan.reason.planned:
        return plan.reason
    if measurement != Reason.SOLVED:
        return measurement
    return Reason.STOPPING if memory.last_step >= 0 else plan.reason
