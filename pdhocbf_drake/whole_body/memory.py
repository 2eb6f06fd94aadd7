"""What the whole-body layer remembers from tick to tick."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.whole_body.deviation import Deviation
from pdhocbf_drake.whole_body.kernels import AWAY, ERROR, JOINTS, LAST, PERSISTS, PLACE, RATE, TABLE


class BodyMemory(NamedTuple):
    """The layer's memory, one vector, which begins with 1 where there is a deviation, else 0.

    The joints' PD adds to a planned torque what it added one gait ago, and half of the last tick's difference from
    that: the whole difference says less where the load changes feet.

    Attributes:
        deviation: see `Deviation`.
        last: feedforward torques of the last tick (12,) [N m].
        error: what the PD added at the last tick that is measured, less what it added one gait before (12,) [N m].
        table: torque that the PD added at each tick of a gait, or where none has been walked yet at the last tick,
            (T, 12) [N m].
    """

    deviation: Deviation
    last: np.ndarray
    error: np.ndarray
    table: np.ndarray

    @classmethod
    def start(cls, torque: np.ndarray, ticks: int) -> np.ndarray:
        """The vector of a robot at rest, with the torques of its stand (12,), for a gait of so many ticks."""
        vector = np.zeros(TABLE + JOINTS * ticks)
        vector[LAST:ERROR] = torque
        return vector

    @classmethod
    def of(cls, state: np.ndarray) -> BodyMemory:
        """From its vector."""
        deviation = Deviation(state[PLACE:RATE], state[RATE:LAST])
        return cls(deviation, state[LAST:ERROR], state[ERROR:TABLE], state[TABLE:].reshape(-1, JOINTS))

    def added(self, tick: int) -> np.ndarray:
        """What the PD is predicted to add at a tick of the gait (12,) [N m]."""
        return np.asarray(self.table[tick] + PERSISTS * self.error)

    def after(self, deviation: Deviation, torque: np.ndarray, out: np.ndarray) -> None:
        """Writes the vector a tick later."""
        out[AWAY], out[PLACE:RATE], out[RATE:LAST] = deviation.is_any, deviation.place, deviation.rate
        out[LAST:ERROR], out[ERROR:TABLE], out[TABLE:] = torque, self.error, self.table.ravel()
