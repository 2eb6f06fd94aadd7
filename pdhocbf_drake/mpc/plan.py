"""What the periodic MPC answers at one tick."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pdhocbf_drake.mpc.solution import Reason


@dataclass(frozen=True)
class Plan:
    """One tick's answer.

    Attributes:
        tick: k.
        inputs: ZMP velocities u(k) … u(k + H − 1) per axis, shape (2, H) [m/s].
        footholds: centres of the coming stance feet per axis, shape (2, n_f) [m].
        active: flags of the active constraints per axis, for the next warm start.
        slack: the barriers' largest slack [m/s].
        cost: of both axes; NaN where not solved.
        reason: why the plan is what it is.
        fallbacks: ticks in a row without a solution, this one included.
    """

    tick: int
    inputs: np.ndarray
    footholds: np.ndarray
    active: tuple[np.ndarray, np.ndarray]
    slack: float
    cost: float
    reason: Reason
    fallbacks: int
    recovering: bool = False
