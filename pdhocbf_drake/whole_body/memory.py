"""What the whole-body layer remembers from tick to tick."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.whole_body.deviation import TASKS, Deviation
from pdhocbf_drake.whole_body.kernels import JOINTS

_LAST = 2 * TASKS
_ERROR = _LAST + JOINTS
_TABLE = _ERROR + JOINTS
_PERSISTS = 0.5  # share of the last error that the next tick is predicted to have


class BodyMemory(NamedTuple):
    """The layer's memory, one vector.

    The joints' PD adds to a planned torque what it added one gait ago, and half of the last tick's difference from
    that: the whole difference says less where the load changes feet.

    Attributes:
        deviation: see `Deviation`.
        last: feedforward torques of the last tick (12,) [N m].
        error: what the PD added at the last tick that is measured, less what it added one gait before (12,) [N m].
        table: torque that the PD added at each tick of a gait, (T, 12) [N m].
    """

    deviation: Deviation
    last: np.ndarray
    error: np.ndarray
    table: np.ndarray

    @classmethod
    def start(cls, torque: np.ndarray, ticks: int) -> np.ndarray:
        """The vector of a robot at rest, with the torques of its stand (12,), for a gait of so many ticks."""
        return np.concatenate([np.zeros(_LAST), torque, np.zeros(JOINTS * (1 + ticks))])

    @classmethod
    def of(cls, state: np.ndarray) -> BodyMemory:
        """From its vector."""
        table = state[_TABLE:].reshape(-1, JOINTS)
        return cls(Deviation.of(state[:_LAST]), state[_LAST:_ERROR], state[_ERROR:_TABLE], table)

    def added(self, tick: int) -> np.ndarray:
        """What the PD is predicted to add at a tick of the gait (12,) [N m]."""
        return np.asarray(self.table[tick] + _PERSISTS * self.error)

    def after(self, deviation: Deviation, torque: np.ndarray) -> np.ndarray:
        """The vector a tick later."""
        return np.concatenate([deviation.place, deviation.rate, torque, self.error, self.table.ravel()])

    def learned(self, tick: int, added: np.ndarray) -> np.ndarray:
        """The vector with what the PD added at a tick of the gait (12,) [N m], unless that is not finite."""
        if not np.isfinite(added).all():
            return self.after(self.deviation, self.last)
        table = self.table.copy()
        table[tick] = added
        return self._replace(error=added - self.table[tick], table=table).after(self.deviation, self.last)
