"""Faults of sensors between them and the estimator."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from pdhocbf_drake.estimation.config import SensorFault
from pdhocbf_drake.systems.signals import JOINTS, size, sizes

_FLICKER = 2  # ticks with and without a signal

PLACES: Final[dict[str, tuple[str, list[int]]]] = {
    "gyroscope": ("imu", [0, 1, 2, 6, 7, 8]),
    "accelerometer": ("imu", [3, 4, 5]),
    "imu": ("imu", list(range(9))),
    "encoders": ("encoders", list(range(24))),
    "left_force_torque": ("force_torque", list(range(6))),
    "right_force_torque": ("force_torque", list(range(6, 12))),
    **{joint: ("encoders", [place, len(JOINTS) + place]) for place, joint in enumerate(JOINTS)},
}
"""Each sensor that may fail: the port it is part of, and its places there."""


class SensorFaults(LeafSystem):
    """Hands on what the sensors say, but for those that fail.

    Input ports, and output parts, see `unbundled`:
        imu (9), encoders (24), force_torque (12): as in `systems.signals`. What they were at the last tick is this
            block's discrete state, at which a stuck sensor stays.

    Args:
        tick: δ [s].
    """

    def __init__(self, faults: Sequence[SensorFault], tick: float) -> None:
        super().__init__()
        self.parts, self._tick = sizes("imu", "encoders", "force_torque"), tick
        starts = dict(zip(self.parts, np.cumsum([0, *self.parts.values()]).tolist(), strict=False))
        self._faults = []
        for fault in faults:
            port, places = PLACES[fault.sensor]
            first = round(fault.time / tick)
            last = np.inf if fault.duration is None else first + max(1, round(fault.duration / tick))
            self._faults.append((fault.kind, np.array(places) + starts[port], first, last))
        self._ports = [self.DeclareVectorInputPort(name, size(name)) for name in self.parts]
        count = sum(self.parts.values())
        self.DeclareDiscreteState(count)
        self.DeclarePeriodicDiscreteUpdateEvent(tick, 0.0, self._update)
        self._out = self.DeclareVectorOutputPort("given", count, self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        given = np.concatenate([port.Eval(context) for port in self._ports])
        before, tick = context.get_discrete_state_vector().value(), round(context.get_time() / self._tick)
        for kind, places, first, last in self._faults:
            if not first <= tick < last:
                continue
            if kind == "stuck":
                given[places] = before[places]
            elif kind == "lost":
                given[places] = np.nan
            elif kind == "zero" or (tick - first) // _FLICKER % 2 == 0:
                given[places] = 0.0
        output.SetFromVector(given)

    def _update(self, context: Context, values: DiscreteValues) -> None:
        values.set_value(self._out.Eval(context))
