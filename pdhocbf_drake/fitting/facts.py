"""What default values depend on: the size, mass and soles of a robot."""

from __future__ import annotations

from typing import NamedTuple

from pdhocbf_drake.robot import SIDES, Biped
from pdhocbf_drake.robot.leg import leg_length


class RobotFacts(NamedTuple):
    """A robot in six numbers.

    Attributes:
        leg: thigh and shank [m].
        mass: total [kg].
        sole: half length and half width of the smaller sole [m].
        com_height: at which it stands and walks [m].
        stance_width: lateral distance of the soles' centres [m].
    """

    leg: float
    mass: float
    sole: tuple[float, float]
    com_height: float
    stance_width: float

    @classmethod
    def of(cls, biped: Biped) -> RobotFacts:
        """Those of a robot."""
        length, width = (min(float(biped.soles[side].half_size[axis]) for side in SIDES) for axis in (0, 1))
        config = biped.config
        return cls(leg_length(biped), biped.mass, (length, width), config.com_height, config.stance_width)


PACKAGED = RobotFacts(0.6, 29.0, (0.1, 0.06), 0.58, 0.16)
"""`models/biped`, for which the default values in configs and packaged scenarios are written."""
