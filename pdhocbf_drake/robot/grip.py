"""What friction lets the soles carry about the vertical."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.robot.biped import Biped
from pdhocbf_drake.robot.config import SIDES
from pdhocbf_drake.robot.feedforward import torso_yaw_lever

_SHARE = 0.8  # of what the soles carry just before they slip


class Grip(NamedTuple):
    """Friction of the soles, and how the torso's yaw changes what it has to carry.

    Attributes:
        friction: Coulomb coefficient that is believed [1].
        radius: moment over μ F_z at which a sole without a horizontal force turns [m].
        lever: see `robot.feedforward.torso_yaw_lever` [m s²].
    """

    friction: float
    radius: float
    lever: float

    @classmethod
    def of(cls, biped: Biped, q: np.ndarray, friction: float, zmp_box: tuple[float, float]) -> Grip:
        """That of a robot which stands in q (19,), its ZMP at worst at a corner of the box in its sole.

        With loads n_i at the sole's corners r_i whose centre is the ZMP p, a sole turns at Σ μ n_i |r_i − p|.
        """
        half = np.min([biped.soles[side].half_size for side in SIDES], axis=0)
        corner = np.minimum(np.array(zmp_box) / 2.0, half)
        signs = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])
        loads = np.prod(0.5 * (1.0 + signs * corner / half), axis=1)
        radius = float(loads @ np.linalg.norm(signs * half - corner, axis=1))
        return cls(friction, radius, torso_yaw_lever(biped, q))

    def largest_moment(self, used: float) -> float:
        """The largest moment over F_z about the vertical where |F_xy|/F_z is used [m].

        Force and moment at which a sole slips lie near the ellipse (|F_xy|/μF_z)² + (M_z/μ radius F_z)² = 1.
        """
        share = min(used / self.friction, 1.0)
        return _SHARE * self.friction * self.radius * math.sqrt(1.0 - share * share)
