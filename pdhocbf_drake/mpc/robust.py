"""How much nearer the bounds of the MPC are for what `mpc.robust` allows the true state to differ by."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.barriers import AffineBarrier
from pdhocbf_drake.barriers.uncertainty import Uncertainty, nearer_barrier, prediction_errors, tightening
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.config import Box, MpcConfig
from pdhocbf_drake.walking.vhip import Vhip

_COM = np.array([[1.0, 0.0, 0.0]])


def check_boxes(boxes: Sequence[Box], ticks: int, what: str) -> None:
    """Raises `InputError` unless there is one box for all ticks, or one for each tick of a step."""
    if len(boxes) not in (1, ticks):
        raise InputError(f"{what}: one box, or one for each of {ticks} ticks of a step, is needed, given {len(boxes)}")


def uncertainty(vhip: Vhip, config: MpcConfig, axis: int) -> Uncertainty | None:
    """What is not known of [c, v, p] of an axis: nothing of c and v, the ZMP is the planned one; None where all is.

    Raises:
        InputError: neither one box of disturbances nor one for each tick of a step.
    """
    robust = config.robust
    if robust is None:
        return None
    boxes, errors = np.array(robust.boxes(axis)), np.array(robust.errors)
    check_boxes(robust.boxes(axis), vhip.period, f"mpc.robust.disturbance.{'xy'[axis]}")
    if not (np.any(boxes) or np.any(errors)):
        return None
    moved, missed = np.column_stack([boxes, np.zeros(len(boxes))]), np.append(errors, 0.0)
    return Uncertainty(moved, missed, config.delay_ticks, robust.innovations)


def nearer_bound(barrier: AffineBarrier, vhip: Vhip, config: MpcConfig, axis: int) -> NDArray[np.float64] | None:
    """By how much the bound of a barrier along an axis comes nearer at every tick of one period; None for not at all.

    Returns:
        t of (R4) in docs/robust.md, (P,) [unit of h].
    """
    known = uncertainty(vhip, config, axis)
    return None if known is None else tightening(barrier, vhip.system, known).bound


def enforced_barrier(barrier: AffineBarrier, vhip: Vhip, config: MpcConfig, axis: int) -> AffineBarrier:
    """The barrier whose rows the MPC has: the given one, or that with the nearer bound."""
    nearer = nearer_bound(barrier, vhip, config, axis)
    return barrier if nearer is None else nearer_barrier(barrier, nearer)


def zmp_margin(vhip: Vhip, config: MpcConfig) -> float:
    """How far inside its box the ZMP is planned to stay [m]: `mpc.zmp_margin` and what the true ZMP may differ by.

    The robot is sent the acceleration eta (ĉ − p) of the predicted CoM ĉ, which at the true one c takes the ZMP
    c − (ĉ − p): it differs from the planned p by as much as c from ĉ, at the worst tick and along the worse axis.
    """
    known = [uncertainty(vhip, config, axis) for axis in (0, 1)]
    errors = [prediction_errors(_COM, vhip.system, part, part.delay).max() for part in known if part is not None]
    return config.zmp_margin + float(max(errors, default=0.0))
