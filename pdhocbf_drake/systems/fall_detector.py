"""Blocks that end a run when the robot, or the template, has fallen."""

from __future__ import annotations

import math

from pydrake.systems.framework import Context, EventStatus

from pdhocbf_drake.ground.terrain import Terrain
from pdhocbf_drake.systems.block import Block
from pdhocbf_drake.systems.signals import places, size

_STANDS = EventStatus.Succeeded()
_FRACTION = 0.7  # of the nominal CoM height
(_Z,) = places("com_z", "z")
_PLACE = places("lip_state", "x", "y")


class FallDetector(Block):
    """Ends the run when the robot's CoM is at or below 70 % of its nominal height, or its height is not finite.

    Checked once a tick. Heights are those above the ground under the CoM.

    Input ports:
        com_z (2) [m, m/s].
        lip_state (6): on ground that is not flat, for x and y of the CoM.

    Args:
        height: nominal height of the CoM [m]. tick: δ [s].
        terrain: the ground; None where it is flat.
    """

    def __init__(self, height: float, tick: float, terrain: Terrain | None = None) -> None:
        super().__init__()
        self._least, self._terrain = _FRACTION * height, terrain
        self._com_z = self.DeclareVectorInputPort("com_z", size("com_z"))
        self._lip = None if terrain is None else self.DeclareVectorInputPort("lip_state", size("lip_state"))
        self.DeclarePeriodicPublishEvent(tick, 0.0, self._check)

    def _check(self, context: Context) -> EventStatus:
        height = self._com_z.Eval(context)[_Z]
        if self._terrain is not None and self._lip is not None:
            x, y = self._lip.Eval(context)[_PLACE].tolist()
            height -= self._terrain.height(x, y, known=False) if math.isfinite(x + y) else math.nan
        if math.isfinite(height) and height > self._least:
            return _STANDS
        return EventStatus.ReachedTermination(self, f"fell: the CoM is below {self._least:.2f} m")


class LeanDetector(Block):
    """Ends the run when the template leans by more than 45°: its CoM is farther from the ZMP than it is high.

    Checked once a tick; a state with NaN ends the run as well. In single support a walk leans by less than half a
    step, and no foothold within a leg's reach stops a lean of 45°.

    Input ports:
        lip_state (6): c, v, p of x, then of y [m, m/s, m].

    Args:
        height: of the CoM [m]. tick: δ [s].
    """

    def __init__(self, height: float, tick: float) -> None:
        super().__init__()
        self._height = height
        self._lip = self.DeclareVectorInputPort("lip_state", size("lip_state"))
        self.DeclarePeriodicPublishEvent(tick, 0.0, self._check)

    def _check(self, context: Context) -> EventStatus:
        x, _, x_zmp, y, _, y_zmp = self._lip.Eval(context).tolist()
        lean = math.hypot(x - x_zmp, y - y_zmp)
        if lean <= self._height:
            return _STANDS
        return EventStatus.ReachedTermination(self, f"fell: the CoM is {lean:.2f} m beside the ZMP")
