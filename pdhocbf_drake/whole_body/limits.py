"""The limits of a robot's joints and soles as the rows of a program."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.robot.biped import Biped
from pdhocbf_drake.robot.config import SIDES
from pdhocbf_drake.whole_body.kernels import PER_SOLE
from pdhocbf_drake.whole_body.reason import Reason

_LOAD, _ALONG, _CENTRE, _TWIST = slice(0, 1), slice(1, 5), slice(5, 9), slice(9, 11)

OF_ROWS = np.empty(PER_SOLE, dtype=np.int64)
"""The `Reason` of each row of a sole."""
for _rows, _reason in (
    (_LOAD, Reason.LOAD), (_ALONG, Reason.FRICTION), (_CENTRE, Reason.COP), (_TWIST, Reason.TWIST)
):  # fmt: skip
    OF_ROWS[_rows] = _reason


class SoleLimits(NamedTuple):
    """low ≤ rows · [force; moment] ≤ high of each sole, in its axes and about its centre, over the robot's weight:

        f_z ≥ 0,   |f_x|, |f_y| ≤ μ/√2 f_z,   |m_y| ≤ l f_z,   |m_x| ≤ w f_z,   |m_z| ≤ r f_z,

    with half length l and half width w, over which the moments are taken, and the twist r, see `robot.grip`.

    Attributes:
        rows: (2, 11, 6). low, high: (11,).
    """

    rows: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, biped: Biped, friction: float, radius: float) -> SoleLimits:
        """Those of a robot's soles for a friction [1] and the arm of the friction about the vertical [m]."""
        rows, inside = np.zeros((2, PER_SOLE, 6)), friction / math.sqrt(2.0)
        low, high = np.full(PER_SOLE, -np.inf), np.zeros(PER_SOLE)
        low[_LOAD], high[_LOAD] = 0.0, np.inf
        for part in (_ALONG, _CENTRE, _TWIST):
            low[part.start + 1 : part.stop : 2], high[part.start + 1 : part.stop : 2] = 0.0, np.inf
        for sole, side in enumerate(SIDES):
            half_length, half_width = biped.soles[side].half_size
            rows[sole, 0, 2] = 1.0
            for row, column, arm, of_load in (
                (1, 0, 1.0, inside), (3, 1, 1.0, inside), (5, 4, half_length, 1.0), (7, 3, half_width, 1.0),
                (9, 5, radius, friction),
            ):  # fmt: skip
                rows[sole, row : row + 2, column] = 1.0 / arm
                rows[sole, row : row + 2, 2] = -of_load, of_load
        return cls(rows / biped.weight, low, high)
