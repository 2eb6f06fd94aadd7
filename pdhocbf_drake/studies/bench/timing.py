"""Times routes on the same problems, interleaved, so that what else the machine does meets all of them."""

from __future__ import annotations

import gc
from collections.abc import Callable, Sequence

import numpy as np

from pdhocbf_drake.studies.bench.recording import Tick
from pdhocbf_drake.studies.bench.routes import Route


def time_routes(
    routes: Sequence[Route], ticks: Sequence[Tick], passes: int, block: int, progress: Callable[[float], None]
) -> dict[str, np.ndarray]:
    """Seconds of each tick in each pass, by the route's name, shape (passes, ticks).

    The routes take turns after every `block` ticks (one step of the walk), each block once unclocked before the first
    pass. The garbage collector waits outside, where it would strike one route for what another one left.
    """
    seconds = {route.name: np.empty((passes, len(ticks))) for route in routes}
    for route in routes:
        for given in ticks[:block]:
            route.seconds(given)
    for number in range(passes):
        for start in range(0, len(ticks), block):
            for route in routes:
                gc.collect(0)
                gc.disable()
                try:
                    for i in range(start, min(start + block, len(ticks))):
                        seconds[route.name][number, i] = route.seconds(ticks[i])
                finally:
                    gc.enable()
            progress((number * len(ticks) + start) / (passes * len(ticks)))
    return seconds


def typical(seconds: np.ndarray) -> np.ndarray:
    """Each tick's median over the passes, which a preempted pass does not move, shape (ticks,)."""
    return np.asarray(np.median(seconds, axis=0))
