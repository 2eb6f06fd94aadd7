"""What the controller believes of the robot at a tick, and what it sends: what lies between measurements and plans.

measured d ticks ago  →  carried forward  →  filtered  →  plan  →  less the disturbance, ahead of the ZMP's lag
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.mpc.cancelling import estimated, lead
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.filtering import CoMFilter
from pdhocbf_drake.mpc.kernels import believe, carry_forward, write_cancelling, write_sent
from pdhocbf_drake.mpc.plan import Plan, Reason
from pdhocbf_drake.mpc.prediction import zmp_before
from pdhocbf_drake.walking.vhip import Vhip

_MOVED = 1e-6  # [m/s] or [m]: a prediction that changed by more, under a measurement that did not, makes it stale


class Beliefs(NamedTuple):
    """What is carried from tick to tick between measurements and plans; its arrays are never written into.

    Attributes:
        input_disturbance: estimated acceleration that the template does not model in x and y, then what is cancelled of
            it, see `mpc.cancelling`, shape (4,) [m/s²].
        zmp_shift: the ZMP that was last sent less the planned one, in x and y, shape (2,) [m].
        evidence: of a push, for the filter, in x and y, see `mpc.filtering`, shape (2,) [1].
        sent: ZMP velocities u(k − d) … u(k − 1) of the last plans, d the delay, shape (2, d) [m/s].
        acted: what was cancelled d + 1 … 1 ticks before what is cancelled now, shape (2, d + 1) [m/s²].
    """

    input_disturbance: np.ndarray
    zmp_shift: np.ndarray
    evidence: np.ndarray
    sent: np.ndarray
    acted: np.ndarray

    @classmethod
    def at_start(cls, delay: int) -> Beliefs:
        """Nothing disturbs, and nothing has been sent."""
        return cls(np.zeros(4), np.zeros(2), np.zeros(2), np.zeros((2, delay)), np.zeros((2, delay + 1)))

    def trusted(self) -> Beliefs:
        """These at the end of a recovery, of whose estimate only what is cancelled is kept."""
        return self._replace(input_disturbance=np.tile(self.input_disturbance[2:], 2))


class Believed(NamedTuple):
    """What a measurement comes to.

    Attributes:
        state: [c, v, p] at tick k to plan from, shape (2, 3).
        reason: whether the measurement was used.
        measured: c and v of both axes as measured, shape (4,); those of before where they are not finite.
        beliefs: after the measurement.
    """

    state: np.ndarray
    reason: Reason
    measured: np.ndarray
    beliefs: Beliefs


class Believer:
    """From what is measured to the state to plan from, and from a plan to what is sent.

    Args:
        vhip: the template.
        config: delay, noise, disturbance and lag.
    """

    def __init__(self, vhip: Vhip, config: MpcConfig) -> None:
        self._vhip, self._delay, self._horizon = vhip, config.delay_ticks, config.horizon
        self._zmp_measured = config.zmp_state == "measured"
        self._filter = None if config.noise is None else CoMFilter(vhip, config.noise, self._delay)
        self._disturbance, self._lead = config.disturbance, lead(config.zmp_lag, vhip.tick)
        self._eta: list[float] = vhip.eta.tolist()
        self._no_offset = np.zeros((2, self._horizon))
        self._shifts = self._disturbance is not None or self._lead > 0.0

    def state(
        self, beliefs: Beliefs, predicted: np.ndarray, measured: np.ndarray, before: np.ndarray, tick: int,
        latency: float, disturbed: bool = False,
    ) -> Believed:  # fmt: skip
        """What a measurement at tick k comes to.

        CoM position and velocity are the measured ones, the ZMP is the planned one (or, with Remark 8 to the letter,
        the measured one). A measurement that is not finite, or that repeats bit for bit while the plan moves on, is
        replaced by what the last plan predicts.

        What is planned from a measurement takes effect `latency` later [s]: the measured CoM is moved on over that
        time, c + τ v and v + τ eta(k) (c − p), or the robot would lag behind every plan by as much. A measurement that
        is late by d ticks is carried forward after that.

        Args:
            beliefs: before it.
            predicted: c, v, p of x, then of y, by the last plan, shape (2, 3).
            measured: likewise; p is read only if `mpc.zmp_state` is "measured".
            before: c and v of both axes as measured a tick earlier, shape (4,).
            tick: k.
            latency: τ [s].
            disturbed: whether the walk is being recovered.
        """
        then, planned = tick - self._delay, predicted
        if self._delay:
            planned = predicted.copy()
            planned[:, 2] = zmp_before(predicted[:, 2], beliefs.sent, self._vhip.tick)
        eta = self._eta[then % self._vhip.period]
        state, com = np.empty((2, 3)), np.empty(4)
        finite, repeats, moves = believe(planned, measured, before, self._zmp_measured, latency, eta, state, com)
        if not finite:
            return Believed(predicted, Reason.BAD_MEASUREMENT, before, beliefs)
        if self._delay:
            carry_forward(self._vhip.A, self._vhip.B, then, beliefs.sent, state)
            moves = float(np.abs(state[:, :2] - predicted[:, :2]).max())
            if not self._zmp_measured:
                state[:, 2] = predicted[:, 2]
        if repeats and moves > _MOVED:
            return Believed(predicted, Reason.STALE_MEASUREMENT, com, beliefs)
        if self._filter is not None:
            beliefs = beliefs._replace(evidence=self._filter.believed(predicted, state, beliefs.evidence))
        if self._disturbance is not None:
            w, acted, age = beliefs.input_disturbance, beliefs.acted, max(then, 0)
            error = float(state[0, 1] - predicted[0, 1]), float(state[1, 1] - predicted[1, 1])
            after = estimated(self._disturbance, self._vhip.tick, age, w, error, acted[:, 0], disturbed)
            acted = np.column_stack([acted[:, 1:], w[2:]]) if self._delay else w[2:, None]
            beliefs = Beliefs(after, beliefs.zmp_shift, beliefs.evidence, beliefs.sent, acted)
        return Believed(state, Reason.SOLVED, com, beliefs)

    def zmp_offset(self, beliefs: Beliefs, tick: int, offset: np.ndarray | None) -> np.ndarray | None:
        """Expected real minus template ZMP at k + 1 … k + H (2, H), with what cancels the disturbance, w/eta [m]."""
        cancelled = beliefs.input_disturbance[2:]
        if self._disturbance is None or (cancelled[0] == 0.0 and cancelled[1] == 0.0):
            return offset
        given, both = self._no_offset if offset is None else offset, np.empty((2, self._horizon))
        write_cancelling(beliefs.input_disturbance, self._vhip.eta, tick + 1, given, both)
        return both

    def sent(
        self, beliefs: Beliefs, plan: Plan, com: np.ndarray, zmp: np.ndarray
    ) -> tuple[Beliefs, np.ndarray, np.ndarray]:
        """com_reference and zmp_reference of tick k + 1 as they are sent, from those that were planned."""
        inputs = plan.inputs[:, 0]
        if self._delay:
            beliefs = beliefs._replace(sent=np.column_stack([beliefs.sent[:, 1:], inputs]))
        if not self._shifts:
            return beliefs, com, zmp
        tick, eta = self._vhip.tick, self._eta[(plan.tick + 1) % self._vhip.period]
        com, zmp, shift, ahead = com.copy(), zmp.copy(), np.empty(2), self._lead * tick
        write_sent(beliefs.input_disturbance, eta, ahead, tick, inputs, beliefs.zmp_shift, com, zmp, shift)
        return Beliefs(beliefs.input_disturbance, shift, beliefs.evidence, beliefs.sent, beliefs.acted), com, zmp

    def zmp_velocity(self, state: np.ndarray, zmp: np.ndarray) -> np.ndarray:
        """Velocity (2,) [m/s] of a ZMP that lags as expected, from `state` (2, 3), under a zmp_reference (4,) sent."""
        if not self._lead:
            return zmp[1::2]
        return (zmp[::2] - state[:, 2]) / (self._vhip.tick * (1.0 + self._lead))
