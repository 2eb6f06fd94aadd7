"""The template of one axis as the barriers of a straight walk see it: from the foot that stands."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pdhocbf_drake.barriers.checks import finite_array
from pdhocbf_drake.barriers.dynamics import PeriodicAffineSystem
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.walking.gait import Gait
from pdhocbf_drake.walking.vhip import Vhip

_ON_GROUND = np.array([1.0, 0.0, 1.0])


def stance_system(vhip: Vhip, gait: Gait, axis: int, moves: ArrayLike | None = None) -> PeriodicAffineSystem:
    """s = [c, v, p] of an axis, c and p from the stance foot, under the ZMP velocity, with the period of two steps.

    It is (23), and at a touchdown the step less: s(k+1) = A_k s(k) + B_k u(k) − [m, 0, m] with the move m from this
    foot to the next one. Tick 0 is that of an even step, as of a bound.

    Args:
        axis: 0 (x) or 1 (y).
        moves: m of an even and of an odd step, (2,); None for those commanded, from which the controller moves
            footholds by some millimetres across the heading [m].

    Raises:
        InputError: another axis or shape, or the walk turns, so that its axes are others in each step.
    """
    if axis not in (0, 1):
        raise InputError(f"an axis is 0 (x) or 1 (y), given {axis}")
    if gait.turns:
        raise InputError("a walk that follows commands has no template of one axis: its axes turn with its feet")
    begin, n = gait.config.start_steps, gait.period
    even = begin + begin % 2
    commanded = np.diff([gait.foothold(even + i)[axis] for i in range(3)])
    ways = commanded if moves is None else finite_array("the moves of two steps", moves)
    if ways.shape != (2,):
        raise InputError(f"the moves of two steps must have shape (2,), given {ways.shape}")
    touchdowns = np.zeros((2 * n, 3))
    touchdowns[[n - 1, 2 * n - 1]] = -np.multiply.outer(ways, _ON_GROUND)
    return PeriodicAffineSystem(np.tile(vhip.A, (2, 1, 1)), np.tile(vhip.B[:, :, None], (2, 1, 1)), touchdowns)
