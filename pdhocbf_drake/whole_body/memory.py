"""What the whole-body layer remembers from tick to tick."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.whole_body.deviation import TASKS, Deviation
from pdhocbf_drake.whole_body.kernels import JOINTS

_LAST = 2 * TASKS
_TABLE = _LAST + JOINTS


class BodyMemory(NamedTuple):
    """The layer's memory, one vector.

    The joints' PD adds to a planned torque nearly what it added one gait ago, while what it added a tick ago says
    less than nothing: an ankle's error changes its sign within a tick of the load's transfer.

    Attributes:
        deviation: see `Deviation`.
        last: feedforward torques of the last tick (12,) [N m].
        table: torque that the PD added at each tick of a gait, (T, 12) [N m].
    """

    deviation: Deviation
    last: np.ndarray
    table: np.ndarray

    @classmethod
    def start(cls, torque: np.ndarray, ticks: int) -> np.ndarray:
        """The vector of a robot at rest, with the torques of its stand (12,), for a gait of so many ticks."""
        return np.concatenate([np.zeros(2 * TASKS), torque, np.zeros(JOINTS * ticks)])

    @classmethod
    def of(cls, state: np.ndarray) -> BodyMemory:
        """From its vector."""
        return cls(Deviation.of(state[:_LAST]), state[_LAST:_TABLE], state[_TABLE:].reshape(-1, JOINTS))

    def after(self, deviation: Deviation, torque: np.ndarray) -> np.ndarray:
        """The vector a tick later."""
        return np.concatenate([deviation.place, deviation.rate, torque, self.table.ravel()])

    def learned(self, tick: int, added: np.ndarray) -> np.ndarray:
        """The vector with what the PD added at a tick of the gait (12,) [N m], unless that is not finite."""
        table = self.table
        if np.isfinite(added).all():
            table = table.copy()
            table[tick] = added
        return self._replace(table=table).after(self.deviation, self.last)
