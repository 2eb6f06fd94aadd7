"""The whole-body layer from tick to tick: what is remembered, what is added to the references, and what is reported."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.robot.biped import Biped
from pdhocbf_drake.robot.config import Side
from pdhocbf_drake.robot.feedforward import Feedforward, InverseDynamics
from pdhocbf_drake.robot.grip import Grip
from pdhocbf_drake.robot.posture import LEFT, LEFT_TURN, RIGHT, RIGHT_TURN
from pdhocbf_drake.robot.task_space import TaskSpace
from pdhocbf_drake.whole_body.config import WholeBodyConfig
from pdhocbf_drake.whole_body.deviation import TASKS, Deviation
from pdhocbf_drake.whole_body.kernels import AWAY, ERROR, learn, limit_step
from pdhocbf_drake.whole_body.layer import EXCEEDED, Moving, WholeBody
from pdhocbf_drake.whole_body.memory import BodyMemory
from pdhocbf_drake.whole_body.reason import Reason

_SUPPORT = 2  # of gait_phase, 0 where both feet stand
_LANDING = 0.3  # share of a step before its end in which a swing foot comes back and gives way no more
_LEAVING = 0.5  # share of the load below which a foot that is about to swing may turn

_FEET: dict[Side, slice] = {"left": slice(LEFT.start, LEFT_TURN.stop), "right": slice(RIGHT.start, RIGHT_TURN.stop)}


class Clock(NamedTuple):
    """Tick δ [s], and ticks N of a step."""

    tick: float
    ticks_per_step: int


class Now(NamedTuple):
    """What holds at a tick before its motion is solved.

    Attributes:
        memory: the layer's vector, see `BodyMemory`. tick: of the gait.
        share: of the load, on the left sole. aloft: a foot that carries none, or that is about to and carries little.
        left: time to the end of the step over the part of it in which a foot lands [1].
    """

    memory: np.ndarray
    tick: int
    share: float
    aloft: Side | None
    left: float


class BodyTicks:
    """The whole-body layer of a walk.

    Attributes:
        start: its memory before the first tick, one vector.
        keep: what keeps the limits in a tick.

    Args:
        q: posture at the start (19,).
    """

    def __init__(
        self, biped: Biped, task: TaskSpace, config: WholeBodyConfig, grip: Grip, clock: Clock, q: np.ndarray
    ) -> None:
        self.keep, self._clock = WholeBody(biped, task, config, clock.tick, grip), clock
        self._joints, rest = biped.q_index, np.zeros(TASKS)
        torque = InverseDynamics(biped, task)(q, rest, rest, 0.5).tau
        self.start = BodyMemory.start(torque, 2 * clock.ticks_per_step)

    def now(self, memory: np.ndarray, gait_phase: np.ndarray | None, share: float, swing: Side | None) -> Now:
        """The tick, from the clock and the foot that swings; without a clock the first one of a gait."""
        tick, period = self._tick_of_gait(gait_phase), self._clock.ticks_per_step
        aloft = swing if swing is not None and (share if swing == "left" else 1.0 - share) < _LEAVING else None
        return Now(memory, tick, share, aloft, (period - 1 - tick % period) / (_LANDING * period))

    def add_to(self, now: Now, wanted: np.ndarray, angles: tuple[float, ...]) -> tuple[float, ...]:
        """Adds the deviation to the tasks' motion, wanted (3, 18), in place; the angles of torso and soles with it.

        That of the swing foot fades out over the last part of the step.
        """
        if not now.memory[AWAY]:
            return angles
        deviation = self._deviation(now)
        if now.aloft is not None:
            deviation = deviation.times(_FEET[now.aloft], min(now.left, 1.0))
        return deviation.add_to(wanted, angles, self._clock.tick)

    def end(
        self, now: Now, last: np.ndarray, q: np.ndarray, moving: tuple[np.ndarray, np.ndarray], torque: Feedforward,
        met: bool, said: np.ndarray, memory: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray, Feedforward]:  # fmt: skip
        """q, v̇ and torques within the limits, from those of the closed form.

        Args:
            last: q of the last tick (19,). q, moving, torque: the closed form, with v and v̇.
            met: whether inverse kinematics has met its target.
            said: written, the signal `whole_body` (5,). memory: written, the vector a tick later.
        """
        (v, vdot), yields, tick = moving, now.aloft if now.left >= 1.0 else None, self._clock.tick
        motion = Moving(q, v, vdot, torque, now.share, yields, now.memory, now.tick)
        if met and not now.memory[AWAY] and self.keep.passes(motion, last, memory):
            said[:] = 0.0
            return q, vdot, torque
        deviation = self._deviation(now)
        kept = self.keep(motion, deviation) if met else self.keep.unreached(motion)
        if deviation.is_any or kept.given.any():
            deviation = deviation.after(deviation.returning(tick) + kept.given, tick)
        reason, miss, limited = kept.reason, kept.miss, q.copy()
        beyond = limit_step(last, self.keep.step, self._joints, limited)
        if beyond > EXCEEDED and reason <= Reason.KEPT:
            reason, miss = Reason.RATE, beyond
        BodyMemory.of(now.memory).after(deviation, kept.torque.tau, memory)
        said[:] = reason, miss, *deviation.sizes
        # Where CoM and soles give way, the posture goes on from their references all the same.
        return limited, kept.vdot if reason < Reason.JOINTS else vdot, kept.torque

    def learn(
        self, memory: np.ndarray, gait_phase: np.ndarray | None, applied: np.ndarray, feedforward: np.ndarray
    ) -> None:
        """Writes what the PD added at a tick into the memory's vector: applied less feedforward torques (12,) [N m]."""
        stands = gait_phase is not None and gait_phase[_SUPPORT] == 0.0
        learn(memory, self._tick_of_gait(gait_phase), applied, feedforward, stands)

    def forget(self, memory: np.ndarray) -> None:
        """Forgets in the memory's vector what the PD has added.

        In a disturbed walk it adds something else than a gait ago; and where a joint gives all its torque, it adds more
        the farther the robot sinks. To let torso and swing foot give way for that borrows from the ticks to come, in
        which the knee has less to give: a foot that lands on another place, and a torso that leans.
        """
        memory[ERROR:] = 0.0

    def _deviation(self, now: Now) -> Deviation:
        """That of the last tick, but for feet that carry load."""
        deviation = BodyMemory.of(now.memory).deviation
        for side, part in _FEET.items():
            if side != now.aloft:
                deviation = deviation.times(part, 0.0)
        return deviation

    def _tick_of_gait(self, gait_phase: np.ndarray | None) -> int:
        """The tick within two steps; 0 without a clock."""
        if gait_phase is None:
            return 0
        phase, step, _ = gait_phase.tolist()
        return int(phase + self._clock.ticks_per_step * (step % 2.0)) % (2 * self._clock.ticks_per_step)
