"""The whole-body layer from tick to tick: what is remembered, what is added to the references, and what is reported."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.robot.biped import Biped
from pdhocbf_drake.robot.config import Side
from pdhocbf_drake.robot.feedforward import Feedforward, InverseDynamics
from pdhocbf_drake.robot.grip import Grip
from pdhocbf_drake.robot.posture import LEFT, RIGHT
from pdhocbf_drake.robot.task_space import TaskSpace
from pdhocbf_drake.whole_body.config import WholeBodyConfig
from pdhocbf_drake.whole_body.deviation import TASKS, Deviation
from pdhocbf_drake.whole_body.kernels import limit_step
from pdhocbf_drake.whole_body.layer import EXCEEDED, Moving, WholeBody
from pdhocbf_drake.whole_body.memory import BodyMemory
from pdhocbf_drake.whole_body.reason import Reason

_LANDING = 0.3  # share of a step before its end in which a swing foot comes back and gives way no more

_FEET: dict[Side, slice] = {"left": LEFT, "right": RIGHT}


class Clock(NamedTuple):
    """Tick δ [s], and ticks N of a step."""

    tick: float
    ticks_per_step: int


class Begun(NamedTuple):
    """A tick before its motion is solved.

    Attributes:
        memory: of the last tick. deviation: of it what is left, that of feet that carry load is dropped.
        angles: of torso, left and right sole [rad]. added: what the PD is predicted to add (12,) [N m].
        share: of the load, on the left sole. yields: the foot that may give way.
    """

    memory: BodyMemory
    deviation: Deviation
    angles: tuple[float, ...]
    added: np.ndarray
    share: float
    yields: Side | None


class Ended(NamedTuple):
    """A tick's motion within the limits.

    Attributes:
        said: the signal `whole_body` (5). q, vdot, torque: as in `Moving`. memory: its vector a tick later.
    """

    said: tuple[float, ...]
    q: np.ndarray
    vdot: np.ndarray
    torque: Feedforward
    memory: np.ndarray


class BodyTicks:
    """The whole-body layer of a walk.

    Attributes:
        start: its memory before the first tick, one vector.

    Args:
        q: posture at the start (19,).
    """

    def __init__(
        self, biped: Biped, task: TaskSpace, config: WholeBodyConfig, grip: Grip, clock: Clock, q: np.ndarray
    ) -> None:
        self._keep, self._clock = WholeBody(biped, task, config, clock.tick, grip), clock
        self._joints, self._step = biped.q_index, clock.tick * biped.velocity_limits
        rest = np.zeros(TASKS)
        torque = InverseDynamics(biped, task)(q, rest, rest, 0.5).tau
        self.start = BodyMemory.start(torque, 2 * clock.ticks_per_step)

    def tick_of_gait(self, gait_phase: np.ndarray | None) -> int:
        """The tick within two steps; 0 without a clock."""
        if gait_phase is None:
            return 0
        phase, step, _ = gait_phase.tolist()
        return int(phase + self._clock.ticks_per_step * (step % 2.0)) % (2 * self._clock.ticks_per_step)

    def begin(
        self, state: np.ndarray, gait_phase: np.ndarray | None, share: float, swing: Side | None, wanted: np.ndarray,
        angles: tuple[float, ...],
    ) -> Begun:  # fmt: skip
        """Adds the deviation to the tasks' motion, wanted (3, 18), in place.

        That of the swing foot fades out over the last part of the step.
        """
        memory, now = BodyMemory.of(state), self.tick_of_gait(gait_phase)
        period, deviation = self._clock.ticks_per_step, memory.deviation
        left = (period - 1 - now % period) / (_LANDING * period)  # 1 where the landing begins
        aloft = swing if swing is not None and (share if swing == "left" else 1.0 - share) == 0.0 else None
        if deviation.is_any:
            for side, part in _FEET.items():
                if side != aloft:
                    deviation = deviation.times(part, 0.0)
            fading = deviation if aloft is None else deviation.times(_FEET[aloft], min(left, 1.0))
            angles = fading.add_to(wanted, angles, self._clock.tick)
        return Begun(memory, deviation, angles, memory.added(now), share, aloft if left >= 1.0 else None)

    def end(
        self, begun: Begun, last: np.ndarray, q: np.ndarray, v: np.ndarray, vdot: np.ndarray, torque: Feedforward,
        met: bool,
    ) -> Ended:  # fmt: skip
        """The motion within the limits, from that of the closed form.

        Args:
            last: q of the last tick (19,). q, v, vdot, torque: the closed form, see `Moving`.
            met: whether inverse kinematics has met its target.
        """
        memory, deviation, tick = begun.memory, begun.deviation, self._clock.tick
        moving = Moving(q, v, vdot, torque, begun.share, begun.yields, begun.added, memory.last)
        kept = self._keep(moving, deviation) if met else self._keep.unreached(moving)
        if deviation.is_any or kept.given.any():
            deviation = deviation.after(deviation.returning(tick) + kept.given, tick)
        reason, miss, limited = kept.reason, kept.miss, q.copy()
        beyond = limit_step(last, self._step, self._joints, limited)
        if beyond > EXCEEDED and reason <= Reason.KEPT:
            reason, miss = Reason.RATE, beyond
        # Where CoM and soles give way, the posture goes on from their references all the same.
        vdot = kept.vdot if reason < Reason.JOINTS else vdot
        said = float(reason), miss, *deviation.sizes
        return Ended(said, limited, vdot, kept.torque, memory.after(deviation, kept.torque.tau))

    def learned(self, state: np.ndarray, gait_phase: np.ndarray | None, added: np.ndarray) -> np.ndarray:
        """The memory's vector with what the PD added at a tick (12,) [N m], unless that is not finite."""
        return BodyMemory.of(state).learned(self.tick_of_gait(gait_phase), added)
