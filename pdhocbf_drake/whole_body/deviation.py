"""How far height, torso and swing foot are from their references, and how they come back."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from pydrake.common.eigen_geometry import AngleAxis
from pydrake.math import RollPitchYaw, RotationMatrix

from pdhocbf_drake.robot.posture import COM, LEFT, RIGHT, TORSO_TURN, TURNS

TASKS = 18
_POLE = 0.9  # of the return, twice
_REST = 1e-9  # [m, rad] and each second: below it, all is back
_PLACES = np.r_[COM, LEFT, RIGHT]
_HEIGHT = COM.start + 2


class Deviation(NamedTuple):
    """Deviation ξ of the task coordinates from their references, and its rate, (18,) each [m, rad, s].

    ξ(k+1) = ξ(k) + δ ξ̇(k) and ξ̇(k+1) = ξ̇(k) + δ ξ̈(k). Those of turns are rotation vectors in the world.
    """

    place: np.ndarray
    rate: np.ndarray

    @property
    def is_any(self) -> bool:
        """Whether there is a deviation."""
        return bool(self.place.any() or self.rate.any())

    @property
    def sizes(self) -> tuple[float, float, float]:
        """That of the CoM's height, the angle of the torso, and the distance of the swing foot [m, rad, m]."""
        place, feet = self.place, max(self.place[LEFT] @ self.place[LEFT], self.place[RIGHT] @ self.place[RIGHT])
        return float(place[_HEIGHT]), float(np.linalg.norm(place[TORSO_TURN])), float(np.sqrt(feet))

    def returning(self, tick: float) -> np.ndarray:
        """ξ̈ with which it comes back with both poles at `_POLE`, (18,)."""
        slow = (1.0 - _POLE) / tick
        return -slow * (2.0 * self.rate + slow * self.place)

    def after(self, acceleration: np.ndarray, tick: float) -> Deviation:
        """A tick later [s]; zero where it is back."""
        place, rate = self.place + tick * self.rate, self.rate + tick * acceleration
        back = max(np.abs(place).max(), np.abs(rate).max()) < _REST
        return Deviation(np.zeros(TASKS), np.zeros(TASKS)) if back else Deviation(place, rate)

    def times(self, part: slice, factor: float) -> Deviation:
        """The same, with a part of the task coordinates times a factor."""
        if factor == 1.0 or not (self.place[part].any() or self.rate[part].any()):
            return self
        place, rate = self.place.copy(), self.rate.copy()
        place[part], rate[part] = factor * place[part], factor * rate[part]
        return Deviation(place, rate)

    def add_to(self, wanted: np.ndarray, angles: tuple[float, ...], tick: float) -> tuple[float, ...]:
        """Adds the deviation, its rate and its return to the tasks' motion (3, 18), in place.

        Returns:
            The angles of torso, left and right sole, see `WholeBodyIk.motion`, with these turned.
        """
        wanted[0, _PLACES] += self.place[_PLACES]
        wanted[1] += self.rate
        wanted[2] += self.returning(tick)
        found = list(angles)
        for part, turn in enumerate(TURNS):
            if self.place[turn].any():
                own = slice(3 * part, 3 * part + 3)
                found[own] = _turned(angles[own], self.place[turn])
        return tuple(found)


def _turned(angles: tuple[float, ...], turn: np.ndarray) -> list[float]:
    """Roll, pitch and yaw after a rotation vector in the world, not zero, (3,) [rad]."""
    angle = float(np.linalg.norm(turn))
    turned = RotationMatrix(AngleAxis(angle, turn / angle)) @ RotationMatrix(RollPitchYaw(*angles))
    return RollPitchYaw(turned).vector().tolist()
