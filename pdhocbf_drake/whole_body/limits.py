"""The limits of a robot's joints and soles as the rows of a program."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.robot.biped import Biped
from pdhocbf_drake.robot.config import SIDES
from pdhocbf_drake.whole_body.kernels import CENTRE, PER_SOLE
from pdhocbf_drake.whole_body.reason import Reason

_SIDES = 8  # of the polygon around the circle of friction
_LOAD, _ALONG, _CENTRE, _TWIST = slice(0, 1), slice(1, 9), slice(*CENTRE), slice(13, 15)

OF_ROWS = np.empty(PER_SOLE, dtype=np.int64)
"""The `Reason` of each row of a sole."""
for _rows, _reason in (
    (_LOAD, Reason.LOAD), (_ALONG, Reason.FRICTION), (_CENTRE, Reason.COP), (_TWIST, Reason.TWIST)
):  # fmt: skip
    OF_ROWS[_rows] = _reason


class SoleLimits(NamedTuple):
    """low ≤ rows · [force; moment] ≤ high of each sole, in its axes and about its centre, over the robot's weight:

        f_z ≥ 0,   cos φ_i f_x + sin φ_i f_y ≤ μ f_z,   |m_y| ≤ l f_z,   |m_x| ≤ w f_z,   |m_z| ≤ μ r f_z,

    with eight directions φ_i, half length l and half width w, and the arm r of friction about the vertical, see
    `robot.grip`. Moments are taken over these lengths. The octagon lies around the circle of friction: the force along
    the ground is that of the CoM in x and y, which the plan decides, and height is too weak a lever for it.

    Attributes:
        rows: (2, 15, 6). low, high: (15,).
    """

    rows: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, biped: Biped, friction: float, radius: float) -> SoleLimits:
        """Those of a robot's soles for a friction [1] and the arm of the friction about the vertical [m]."""
        rows = np.zeros((2, PER_SOLE, 6))
        low, high = np.full(PER_SOLE, -np.inf), np.zeros(PER_SOLE)
        low[_LOAD], high[_LOAD] = 0.0, np.inf
        for part in (_CENTRE, _TWIST):
            low[part.start + 1 : part.stop : 2], high[part.start + 1 : part.stop : 2] = 0.0, np.inf
        ways = 2.0 * math.pi / _SIDES * np.arange(_SIDES)
        for sole, side in enumerate(SIDES):
            half_length, half_width = biped.soles[side].half_size
            rows[sole, 0, 2] = 1.0
            rows[sole, _ALONG, :2] = np.column_stack([np.cos(ways), np.sin(ways)])
            rows[sole, _ALONG, 2] = -friction
            for first, column, arm, of_load in (
                (_CENTRE.start, 4, half_length, 1.0), (_CENTRE.start + 2, 3, half_width, 1.0),
                (_TWIST.start, 5, radius, friction),
            ):  # fmt: skip
                rows[sole, first : first + 2, column] = 1.0 / arm
                rows[sole, first : first + 2, 2] = -of_load, of_load
        return cls(rows / biped.weight, low, high)
