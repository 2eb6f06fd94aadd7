"""How much nearer the bounds of the MPC are for what `mpc.robust` allows the true state to differ by."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.barriers import AffineBarrier
from pdhocbf_drake.barriers.uncertainty import Uncertainty, nearer_barrier, prediction_errors, tightening
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.walking.vhip import Vhip

_COM = np.array([[1.0, 0.0, 0.0]])


def uncertainty(config: MpcConfig) -> Uncertainty | None:
    """What is not known of [c, v, p] of an axis: nothing of c and v, the ZMP is the planned one; None where all is."""
    robust = config.robust
    if robust is None or not (any(robust.disturbance) or any(robust.errors)):
        return None
    sides = np.array([*robust.disturbance, 0.0]), np.array([*robust.errors, 0.0])
    return Uncertainty(*sides, config.delay_ticks)


def nearer_bound(barrier: AffineBarrier, vhip: Vhip, config: MpcConfig) -> NDArray[np.float64] | None:
    """By how much a barrier's bound comes nearer at every tick of one period, (P,) [unit of h]; None for not at all."""
    known = uncertainty(config)
    return None if known is None else tightening(barrier, vhip.system, known).bound


def enforced_barrier(barrier: AffineBarrier, vhip: Vhip, config: MpcConfig) -> AffineBarrier:
    """The barrier whose rows the MPC has: the given one, or that with the nearer bound."""
    nearer = nearer_bound(barrier, vhip, config)
    return barrier if nearer is None else nearer_barrier(barrier, nearer)


def zmp_margin(vhip: Vhip, config: MpcConfig) -> float:
    """How far inside its box the ZMP is planned to stay [m]: `mpc.zmp_margin` and what the true ZMP may differ by.

    The robot is sent the acceleration eta (ĉ − p) of the predicted CoM ĉ, which at the true one c takes the ZMP
    c − (ĉ − p): it differs from the planned p by as much as c from ĉ.
    """
    known = uncertainty(config)
    if known is None:
        return config.zmp_margin
    return config.zmp_margin + float(prediction_errors(_COM, vhip.system, known, known.delay).max())
