"""Heights of CoM and ZMP on uneven ground, and how the soles tilt with it."""

from __future__ import annotations

import math

import numpy as np
from pydrake.systems.framework import BasicVector, Context

from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.systems.gait_reference import ChangedGait
from pdhocbf_drake.systems.signals import size
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.com_line import ComLine
from pdhocbf_drake.walking.footsteps import Footstep
from pdhocbf_drake.walking.swing_profile import change_of_ground

_INPUTS = "gait_phase", "com_reference", "zmp_reference"
_POSITION, _VELOCITY, _ACCELERATION = (slice(order, None, 3) for order in range(3))  # of com_reference


class GroundReference(Block):
    """The ground's part in the planned motion: what level ground leaves at zero.

    The CoM is to be at its commanded height over `ComLine`. The ZMP is on the plane of the stance foot, and in double
    support between the planes of both feet, as its box moves from one to the other. A stance foot lies on its plane; a
    swing foot turns from one plane to the next with least jerk, over the whole swing.

    Input ports:
        gait_phase (3), com_reference (6), zmp_reference (4), and those of `ChangedGait`.
    Output ports:
        ground_reference (18): as in `systems.signals`.
    """

    def __init__(self, gait: Gait) -> None:
        super().__init__()
        self._line, self._weight = ComLine(gait.period, gait.config.tick), gait.region.weight.tolist()
        self._tick = gait.config.tick
        ports = [self.DeclareVectorInputPort(name, size(name)) for name in _INPUTS]
        self._phase, self._com, self._zmp = ports
        self._gait = ChangedGait(self, gait)
        prerequisites = {*(port.ticket() for port in ports), *self._gait.tickets}
        self.DeclareVectorOutputPort("ground_reference", size("ground_reference"), weakly(self._calc), prerequisites)

    def _calc(self, context: Context, output: BasicVector) -> None:
        phase, com, zmp = self._phase.Eval(context), self._com.Eval(context), self._zmp.Eval(context)
        output.SetFromVector(self.reference(phase, com, zmp, self._gait(context)))

    def reference(self, gait_phase: np.ndarray, com: np.ndarray, zmp: np.ndarray, gait: Gait) -> np.ndarray:
        """ground_reference (18,) from gait_phase, com_reference and zmp_reference, of the gait as it was changed."""
        tick, step, support = gait_phase.tolist()
        phase, step = round(tick), round(step)
        planes = gait.planes(step)
        line = self._line(phase, planes, com[_POSITION], com[_VELOCITY], com[_ACCELERATION])
        last, here, _ = (planes[:, 0] + planes[:, 1:] @ zmp[::2]).tolist()
        weight = self._weight[phase]
        return np.array(
            [*line, (1.0 - weight) * last + weight * here, *self._soles(phase, step, support, gait)], dtype=float
        )

    def _soles(self, phase: int, step: int, support: float, gait: Gait) -> list[float]:
        """The part of each sole, left then right."""
        this, lift_off = gait.step(step), gait.lift_off(step)
        stands = [0.0, *_tilt(this)]
        if not support:
            return 2 * stands
        before, after, aloft = gait.step(step - 1), gait.seen(step)[step + 1], phase - lift_off
        start, end = _tilt(before), _tilt(after)
        share, rate, change = change_of_ground((0.0, 1.0), (gait.period - lift_off) * self._tick, aloft * self._tick)
        swings = [float(aloft > 0)]
        for angle, other in ((start[0], end[0]), (start[3], end[3])):
            way = other - angle
            swings += [angle + share * way, rate * way, change * way]
        return [*stands, *swings] if support > 0 else [*swings, *stands]


def _tilt(stance: Footstep) -> tuple[float, ...]:
    """Roll and pitch of a sole on its plane, each with two derivatives, which are 0 [rad]."""
    (x, y), c, s = stance.slope, math.cos(stance.yaw), math.sin(stance.yaw)
    ahead, aside = c * x + s * y, c * y - s * x
    return math.asin(aside / math.sqrt(1.0 + x * x + y * y)), 0.0, 0.0, -math.atan(ahead), 0.0, 0.0
