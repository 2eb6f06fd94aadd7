"""What the periodic MPC answers at one tick."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.mpc.solution import Reason

_ALL_MET = np.zeros((2, 3))
_ALL_MET.flags.writeable = False


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
        unmet: of an axis whose program has no solution, by how much the plan misses each of
            `solution.CONSTRAINTS`; else 0, shape (2, 3) [m].
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
    unmet: np.ndarray = _ALL_MET

    @property
    def slack(self) -> float:
        """The barriers' largest slack [m/s]."""
        return float(self.slacks.max(initial=0.0))

    def of_disturbed(self, why: Reason) -> Plan:
        """The same as the plan of a disturbed walk, for the reason `why`, unless its own one is worse."""
        eased = self.reason in (Reason.SOLVED, Reason.SOFTENED)
        return self._replace(recovering=True, reason=why if eased else self.reason)
