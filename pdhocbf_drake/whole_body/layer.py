"""A tick of the whole-body layer: the closed form where it keeps all limits, else the nearest motion that does."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.robot.biped import Biped
from pdhocbf_drake.robot.config import SIDES, Side
from pdhocbf_drake.robot.feedforward import Feedforward
from pdhocbf_drake.robot.grip import Grip
from pdhocbf_drake.robot.posture import COM, LEFT, LEFT_TURN, RIGHT, RIGHT_TURN, TORSO_TURN, TURNS
from pdhocbf_drake.robot.task_space import TaskSpace
from pdhocbf_drake.whole_body.columns import Columns, along_tasks, columns
from pdhocbf_drake.whole_body.config import WholeBodyConfig
from pdhocbf_drake.whole_body.deviation import TASKS, Deviation
from pdhocbf_drake.whole_body.joint_barriers import JointBarriers
from pdhocbf_drake.whole_body.kernels import ERROR, JOINTS, LAST, WRENCH, passes, write_use
from pdhocbf_drake.whole_body.limits import OF_ROWS, SoleLimits
from pdhocbf_drake.whole_body.programs import Bounded, Use, hard_program, soft_program
from pdhocbf_drake.whole_body.reason import SOFTENED, Reason
from pdhocbf_drake.whole_body.solver import solve

EXCEEDED = 1e-9
"""Share of a limit by which a motion may exceed it."""

_USABLE = 0.95  # share of a joint's torque for the plan; the rest is for tracking
_FAST = 0.98  # share of a joint's speed likewise; the rest is for the angles' way between two ticks
_FAR, _TURNED = 0.05, 0.3  # largest deviation, over the CoM's height, and of a turn [rad]
_LIFT = 2.0  # [m/s²]: by which height gives way at most, since what is pressed now is missing later
_DEARER = 100.0  # price of the tasks that give way last, over that of the CoM's height
_OF_LOAD = 1e-2  # price of another share of the load, of the squared share of the weight [m²/s⁴]
_OF_LEG = JOINTS // 2
_FEET_TURN = np.r_[LEFT_TURN, RIGHT_TURN]
_FIRM = 1e-6  # price of squared joint accelerations where they are decisions [m²/rad²]


class Moving(NamedTuple):
    """The motion that the closed form plans for a tick.

    Attributes:
        q, v, vdot: (19,), (18,), (18,). torque: that of inverse dynamics.
        share: of the load, on the left sole. swing: a foot in the air, or about to leave the ground, that may give way.
        memory: the layer's vector, see `BodyMemory`. tick: of the gait, whose entry of the memory holds.
    """

    q: np.ndarray
    v: np.ndarray
    vdot: np.ndarray
    torque: Feedforward
    share: float
    swing: Side | None
    memory: np.ndarray
    tick: int

    @property
    def last(self) -> np.ndarray:
        """Planned torques of the last tick (12,) [N m]."""
        return self.memory[LAST:ERROR]


class Kept(NamedTuple):
    """The motion that is planned instead, or the same.

    Attributes:
        vdot: (18,). torque: as above, within the limits of the joints.
        given: accelerations by which height, torso and swing foot give way (18,) [m/s², rad/s²].
        reason: what became of it. miss: the largest share of a limit by which one is exceeded.
    """

    vdot: np.ndarray
    torque: Feedforward
    given: np.ndarray
    reason: Reason
    miss: float = 0.0


class WholeBody:
    """Keeps the limits of a robot's joints and soles.

    Attributes:
        barriers: on the joints. step: most that they move in a tick (12,) [rad].
        solve: what solves the programs.

    Args:
        task: the robot's task space, in which the motion at hand is set.
        tick: δ [s].
        grip: of the soles.
    """

    def __init__(self, biped: Biped, task: TaskSpace, config: WholeBodyConfig, tick: float, grip: Grip) -> None:
        self._always, self._biped, self._task, self._tick = config.kind == "qp", biped, task, tick
        self.solve = solve
        self._usable, self._joints = _USABLE * biped.effort_limits, biped.v_index
        self._change = np.inf if config.torque_rate is None else config.torque_rate * tick
        lower, upper = np.ascontiguousarray(biped.position_limits.T)
        self.barriers = JointBarriers.of(lower, upper, _FAST * biped.velocity_limits, config.joint_gamma, tick)
        self.step = tick * biped.velocity_limits
        room = np.full(TASKS, _FAR * biped.config.com_height)
        room[np.r_[TURNS]] = _TURNED
        self._room = JointBarriers.of(-room, room, np.full(TASKS, np.inf), config.joint_gamma, tick)
        self._soles = soles = SoleLimits.of(biped, grip.friction, grip.radius)
        self._limits = (
            self._usable, self._change, biped.q_index, biped.v_index, *self.barriers, soles.rows, soles.low, soles.high
        )  # fmt: skip
        self._price = np.full(TASKS, _DEARER * config.height)
        self._price[COM.start + 2] = config.height
        self._price[TORSO_TURN] = config.torso, config.torso, config.torso_yaw
        halves = [biped.soles[side].half_size for side in SIDES]
        self._of_swing, self._of_turn = config.swing, [config.swing * float(half @ half) for half in halves]
        self._own = np.r_[COM.start + 2, TORSO_TURN]
        joints = np.repeat([Reason.TORQUE, 0], JOINTS)
        self._kinds = np.concatenate([joints, OF_ROWS, OF_ROWS])
        self._into = np.empty(len(self._kinds)), np.empty(len(self._kinds)), np.empty(len(self._kinds))

    def __call__(self, moving: Moving, deviation: Deviation) -> Kept:
        """The motion within the limits; nothing here raises.

        Where only the barrier on a joint's angle is exceeded, a foot that may turn gives way, or else CoM and soles,
        since inverse kinematics stops the joint at its limit: to bend the torso for a knee that is nearly straight
        moves the CoM more than the stop does. The planned torques stay.
        """
        use = self._use(moving)
        others_kept = use.worst <= EXCEEDED and not self._always
        if others_kept and use.stopped <= EXCEEDED:
            reason, miss = (Reason.COP, use.outside) if use.outside > EXCEEDED else (Reason.INSIDE, 0.0)
            return Kept(moving.vdot, self._within(moving.torque, moving.last), np.zeros(TASKS), reason, miss)
        tasks, price = self._free(moving, use)
        if others_kept:
            tasks = np.intersect1d(tasks, _FEET_TURN)
        directions = along_tasks(self._task, tasks) if len(tasks) else None
        if directions is not None:
            change = columns(self._biped, self._task, moving.q, directions, moving.share)
            low, high = self._room_left(deviation)
            bounded = self._bounded(np.diag(price[tasks]), low[tasks], high[tasks], change)
            rows = self._rows(change, moving.share)
            for make in (hard_program,) if others_kept else (hard_program, soft_program):
                found = self.solve(make(use, rows, bounded))
                if found is not None:
                    return self._changed(moving, use, change, found, tasks)
        kept = self._of_joints(moving, use, price)
        return kept._replace(torque=self._within(moving.torque, moving.last)) if others_kept else kept

    def unreached(self, moving: Moving) -> Kept:
        """The closed form where inverse kinematics misses its target, its torques within their limits."""
        return Kept(moving.vdot, self._within(moving.torque, moving.last), np.zeros(TASKS), Reason.UNREACHED)

    def _free(self, moving: Moving, use: Use) -> tuple[np.ndarray, np.ndarray]:
        """The tasks that give way, and the prices of all (18,); a foot turns where a joint of its leg is at a limit."""
        tasks, price = self._own, self._price.copy()
        places, loads = ((LEFT, LEFT_TURN), (RIGHT, RIGHT_TURN)), (moving.share, 1.0 - moving.share)
        for leg, (side, (place, turn), load) in enumerate(zip(SIDES, places, loads, strict=True)):
            if side != moving.swing:
                continue
            own = slice(JOINTS + _OF_LEG * leg, JOINTS + _OF_LEG * (leg + 1))
            if max(use.use[own] - use.high[own]) > EXCEEDED or max(use.low[own] - use.use[own]) > EXCEEDED:
                tasks, price[turn] = np.r_[tasks, turn], self._of_turn[leg]
            if not load:
                tasks, price[place] = np.r_[tasks, place], self._of_swing
        return tasks, price

    def _of_joints(self, moving: Moving, use: Use, price: np.ndarray) -> Kept:
        """The motion whose joints keep their limits, CoM and standing soles giving way last.

        Joint accelerations themselves are decisions, so that their limits are bounds, which can always be kept.
        """
        jacobian, own = self._task.jacobian(), slice(JOINTS, 2 * JOINTS)
        order = np.r_[self._joints, self._biped.base_v_index]
        change = columns(self._biped, self._task, moving.q, np.eye(TASKS)[:, order], moving.share)
        low, high = np.full(TASKS, -np.inf), np.full(TASKS, np.inf)
        low[:JOINTS], high[:JOINTS] = (use.low - use.use)[own], (use.high - use.use)[own]
        ordered = jacobian[:, order]
        hessian = ordered.T @ (price[:, None] * ordered) + _FIRM * np.eye(TASKS)
        bounded, soft = self._bounded(hessian, low, high, change), use.kinds > 0
        others = Use(use.use[soft], use.low[soft], use.high[soft], use.kinds[soft], *use[4:])
        found = self.solve(soft_program(others, self._rows(change, moving.share)[soft], bounded))
        if found is None:
            return self._clipped(moving, use)
        kept = self._changed(moving, use, change, found, np.zeros(0, dtype=int))
        return kept._replace(reason=Reason.JOINTS)

    def passes(self, moving: Moving, last: np.ndarray, out: np.ndarray) -> bool:
        """Whether a motion without deviation keeps all limits; if so, its memory a tick later is written into `out`.

        Args:
            last: q of the last tick (19,).
        """
        use, low, high = self._into
        return not self._always and passes(
            *moving.torque, last, moving.q, moving.v, moving.vdot, moving.memory, moving.tick, self._task.poses(),
            moving.share, self._limits, self._biped.effort_limits, self.step, EXCEEDED, use, low, high, out,
        )  # fmt: skip

    def _use(self, moving: Moving) -> Use:
        """What the motion uses of all limits."""
        use, low, high = self._into
        count, *exceeded = write_use(
            *moving.torque, moving.q, moving.v, moving.vdot, moving.memory, moving.tick, self._task.poses(),
            moving.share, self._limits, use, low, high,
        )  # fmt: skip
        return Use(use[:count], low[:count], high[:count], self._kinds[:count], *exceeded)

    def _rows(self, change: Columns, share: float) -> np.ndarray:
        """How the use changes with the decisions (m, n)."""
        rows = [change.tau / self._usable[:, None], change.vdot[self._joints]]
        poses = self._task.poses()[3:].reshape(3, 3, 4)[1:, :, :3]
        for sole, loaded in enumerate((share > 0.0, share < 1.0)):
            if loaded:
                own = self._soles.rows[sole]
                world = np.hstack([own[:, :3] @ poses[sole].T, own[:, 3:] @ poses[sole].T])
                rows.append(world @ change.wrenches[WRENCH * sole : WRENCH * (sole + 1)])
        return np.vstack(rows)

    def _room_left(self, deviation: Deviation) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest accelerations of the tasks beside their return (18,), which keep them near."""
        low, high = self._room.interval(deviation.place, deviation.rate)
        returning = deviation.returning(self._tick)
        low, high = np.minimum(low - returning, 0.0), np.maximum(high - returning, 0.0)
        height = COM.start + 2
        low[height], high[height] = max(low[height], -_LIFT), min(high[height], _LIFT)
        return low, high

    def _bounded(self, hessian: np.ndarray, low: np.ndarray, high: np.ndarray, change: Columns) -> Bounded:
        """The decisions of these columns, the first of which have this cost and these bounds."""
        count, first = change.tau.shape[1], len(low)
        cost = _OF_LOAD * np.eye(count)
        cost[:first, :first] = hessian
        free = np.full(count - first, np.inf)
        return Bounded(cost, np.concatenate([low, -free]), np.concatenate([high, free]))

    def _changed(self, moving: Moving, use: Use, change: Columns, found: np.ndarray, tasks: np.ndarray) -> Kept:
        """The motion with the decisions that were found, the first of which belong to some tasks."""
        count, given = change.tau.shape[1], np.zeros(TASKS)
        decisions, slack = found[:count], found[count:]
        given[tasks] = decisions[: len(tasks)]
        wrenches = np.concatenate([moving.torque.left, moving.torque.right]) + change.wrenches @ decisions
        torque = Feedforward(moving.torque.tau + change.tau @ decisions, wrenches[:WRENCH], wrenches[WRENCH:])
        miss = float(slack.max(initial=0.0))
        reason = Reason.INSIDE if max(use.worst, use.stopped) <= EXCEEDED else Reason.KEPT
        if miss > EXCEEDED:
            reason = SOFTENED[int(slack.argmax())]
        elif use.outside > EXCEEDED:
            reason, miss = Reason.COP, use.outside
        vdot = moving.vdot + change.vdot @ decisions
        return Kept(vdot, self._within(torque, moving.last), given, reason, miss)

    def _clipped(self, moving: Moving, use: Use) -> Kept:
        """The closed form with accelerations of the joints that their barriers allow, and torques within limits."""
        vdot = moving.vdot.copy()
        own = slice(JOINTS, 2 * JOINTS)
        vdot[self._joints] = np.clip(np.nan_to_num(vdot[self._joints]), use.low[own], use.high[own])
        torque = self._within(moving.torque, moving.last)
        return Kept(vdot, torque, np.zeros(TASKS), Reason.NOT_OPTIMAL, max(use.worst, 0.0))

    def _within(self, torque: Feedforward, last: np.ndarray) -> Feedforward:
        """The torques within their rates, then within the limits of the joints."""
        near = np.clip(np.nan_to_num(torque.tau), last - self._change, last + self._change)
        return torque._replace(tau=np.clip(near, -self._biped.effort_limits, self._biped.effort_limits))
