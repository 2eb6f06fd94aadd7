"""The bound of a barrier along a walk, whatever the walk and the bound are."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.barriers import AffineBarrier
from pdhocbf_drake.kept import Kept
from pdhocbf_drake.walking.barrier_changes import Setting
from pdhocbf_drake.walking.commanded_bound import CommandedBound
from pdhocbf_drake.walking.gait import Gait
from pdhocbf_drake.walking.walk_barrier import BoundChanges, BoundSamples, WalkBarrier

Samples = Callable[[int], NDArray[np.float64]]

_BOUNDS = 8  # of the last settings that are kept


def bound_samples(barrier: AffineBarrier, gait: Gait, count: int) -> Samples:
    """V̄(k), …, V̄(k+n−1) of a barrier along a walk, as a function of k."""
    if isinstance(barrier, WalkBarrier):
        if barrier.changes is not None:
            return ChangingBound(barrier, barrier.changes, gait, count)
        if barrier.orbits is not None:
            return CommandedBound(barrier, gait, count)
    return BoundSamples(barrier, gait, count)


class ChangingBound:
    """V̄(k), …, V̄(k+n−1) of a barrier that is changed while the walk goes on, with the setting of tick k throughout.

    Where the barrier is not kept, it is the largest bound that the quantity may have, which no walk reaches.
    """

    def __init__(self, barrier: WalkBarrier, changes: BoundChanges, gait: Gait, count: int) -> None:
        self._changes, self._gait, self._count = changes, gait, count
        self._none = np.full(count, barrier.sign * barrier.quantity.largest)
        self._kept = Kept[Samples](_BOUNDS)

    def __call__(self, tick: int) -> NDArray[np.float64]:
        """V̄(k) … V̄(k+n−1), shape (n,)."""
        setting = self._changes.at(tick)
        if setting.kind == "none":
            return self._none
        samples = self._kept.get(setting[:2], lambda: self._of(setting))
        return samples(tick)

    def _of(self, setting: Setting) -> Samples:
        return bound_samples(self._changes.barrier(setting), self._gait, self._count)
