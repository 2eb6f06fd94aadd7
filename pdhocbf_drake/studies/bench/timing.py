"""The clock of the benchmark, and routes timed in turns on the same problems."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from pdhocbf_drake.studies.bench.recording import Tick

now = time.process_time
"""Processor time of this process [s].

On an idle machine it runs with the wall clock, since nothing here sleeps or uses a second thread. On a shared one it
leaves out what other processes take, though not what they do to the caches: hence turns, medians and ratios.
"""


def time_routes(
    routes: Mapping[str, Callable[[Tick], float]],
    ticks: Sequence[Tick],
    passes: int,
    block: int,
    progress: Callable[[float], None] = lambda share: None,
) -> dict[str, np.ndarray]:
    """Seconds of each tick in each pass, by the route's name, shape (passes, ticks).

    The routes take turns after every `block` ticks (one step of the walk), each block once unclocked before the first
    pass. The garbage collector runs between them, where it does not slow one route for the objects of another.

    Args:
        routes: by name, the seconds that a tick takes.
        progress: called with the share that is done.
    """
    seconds = {name: np.empty((passes, len(ticks))) for name in routes}
    for spent in routes.values():
        for given in ticks[:block]:
            spent(given)
    for number in range(passes):
        for start in range(0, len(ticks), block):
            for name, spent in routes.items():
                gc.collect(0)
                gc.disable()
                try:
                    for i in range(start, min(start + block, len(ticks))):
                        seconds[name][number, i] = spent(ticks[i])
                finally:
                    gc.enable()
            progress((number * len(ticks) + start) / (passes * len(ticks)))
    return seconds


def typical(seconds: np.ndarray) -> np.ndarray:
    """The median of each tick over the passes, which a preempted pass does not move, shape (ticks,)."""
    return np.asarray(np.median(seconds, axis=0))
