"""What the periodic MPC answers at one tick, and why it may be less than an optimum."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np

NOTICED = 1e-6  # [m/s] or [m]: a constraint that is missed by less counts as met


class Reason(IntEnum):
    """Why a tick's plan is what it is; logged as the last entry of `solver_status`."""

    SOLVED = 0
    SOFTENED = 1  # a barrier row can't be met: its slack is paid for
    CROSS_SOLVED = 2  # the first solver stopped without an answer, the second one gave it
    RELAXED = 3  # "stability" can't be met: the tail is missed by as little as possible, and gamma is 1
    INFEASIBLE = 4  # limits of "zmp_box" or "step" contradict each other: the last plan, shifted by a tick
    NOT_OPTIMAL = 5  # no solver gave an answer: the last plan, shifted by a tick
    BAD_MEASUREMENT = 6  # the measured state is not finite: planned from the predicted one
    STALE_MEASUREMENT = 7  # the measured state repeats while the robot should move: likewise
    STOPPING = 8  # degraded for too long: the walk comes to a stand
    RECOVERING = 9  # a disturbance was noticed: planned with the footholds, box and tail of `RecoveryConfig`
    NO_STEADY_PLAN = 10  # nothing was noticed, but the steady walk's program has no solution: planned likewise
    LATE_COMMAND = 11  # the command port has a value that is not finite: the last one that was holds on

    @property
    def planned(self) -> bool:
        """Whether the tick's plan is the answer of a solver."""
        return self not in _NO_PLAN


_NO_PLAN = Reason.INFEASIBLE, Reason.NOT_OPTIMAL
_NOTHING = np.zeros((2, 0))
_NOTHING.flags.writeable = False


class Plan(NamedTuple):
    """One tick's answer.

    Attributes:
        tick: k.
        inputs: ZMP velocities u(k) … u(k + H − 1) per axis, shape (2, H) [m/s].
        footholds: centres of the coming stance feet per axis, shape (2, n_f) [m].
        active: flags of the active constraints per axis, for the next warm start.
        slacks: each barrier's largest slack, those of x, then those of y, shape (n_b,) [m/s].
        cost: of both axes; NaN where not solved.
        reason: why the plan is what it is.
        fallbacks: ticks in a row without a solution, this one included.
        recovering: whether it was planned as a disturbed walk.
        unmet: of an axis whose program has no solution, by how much the plan misses each of `terms.constraints_of`;
            else 0, shape (2, n_c) [m, or as that says].
        acting: 1 for each barrier with an active row, as the plan would be another without it; else 0, shape (n_b,).
    """

    tick: int
    inputs: np.ndarray
    footholds: np.ndarray
    active: tuple[np.ndarray, np.ndarray]
    slacks: np.ndarray
    cost: float
    reason: Reason
    fallbacks: int
    recovering: bool = False
    unmet: np.ndarray = _NOTHING
    acting: np.ndarray = _NOTHING[0]

    @property
    def slack(self) -> float:
        """The barriers' largest slack [m/s]."""
        return max([0.0, *self.slacks.tolist()])

    def turned(self, rotation: np.ndarray) -> Plan:
        """The same in axes that the matrix (2, 2) leads to."""
        return self._replace(inputs=rotation @ self.inputs, footholds=rotation @ self.footholds)

    def of_disturbed(self, why: Reason) -> Plan:
        """The same as the plan of a disturbed walk, for the reason `why`, unless its own one is worse."""
        eased = self.reason in (Reason.SOLVED, Reason.SOFTENED)
        return self._replace(recovering=True, reason=why if eased else self.reason)
