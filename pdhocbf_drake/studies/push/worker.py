"""Pushes shared among processes that end, since Python systems built in a loop are never freed by Drake."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from functools import lru_cache
from multiprocessing import get_context
from typing import NamedTuple

from pdhocbf_drake.errors import PdhocbfError
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.push.directions import force
from pdhocbf_drake.studies.push.results import Impulse
from pdhocbf_drake.studies.push.rig import PushRig
from pdhocbf_drake.studies.push.search import largest_survived
from pdhocbf_drake.studies.push.variants import NONE, variant

_LIMIT = 60.0  # [N s]
# What a robot of this mass is likely to survive, to begin the search from [N s], [kg].
_LIKELY, _LIKELY_MASS = {"+x": 16.0, "-x": 16.0, "+y": 8.0, "-y": 8.0}, 29.0


class Settings(NamedTuple):
    """What all searches of a command share: resolution [N s], length of a push [s], and how long to watch [s]."""

    tolerance: float
    duration: float
    watch: float


class Search(NamedTuple):
    """One direction's search is begun from a guess [N s]; all directions at one phase are one piece of work."""

    scenario: str
    barrier: str
    phases: tuple[int, ...]
    phase: int
    guesses: dict[str, float]
    settings: Settings


@lru_cache(maxsize=1)
def _rig(scenario: str, barrier: str, phases: tuple[int, ...]) -> PushRig:
    return PushRig(variant(Scenario.model_validate_json(scenario), barrier), phases)


def search(work: Search) -> list[Impulse]:
    """The largest survived impulse in each direction at one phase."""
    rig, settings = _rig(work.scenario, work.barrier, work.phases), work.settings

    def in_direction(direction: str) -> Callable[[float], bool]:
        def survives(impulse: float) -> bool:
            pushed = force(direction, impulse, settings.duration)
            return rig.trial(work.phase, pushed, settings.duration, settings.watch).survived

        return survives

    return [
        Impulse(
            work.barrier,
            direction,
            work.phase,
            largest_survived(in_direction(direction), guess, settings.tolerance, _LIMIT),
        )
        for direction, guess in work.guesses.items()
    ]


def search_all(
    scenario: Scenario, barriers: Sequence[str], directions: Sequence[str], phases: Sequence[int],
    settings: Settings, workers: int, mass: float = _LIKELY_MASS, tell: Callable[[int], None] | None = None,
) -> list[Impulse]:  # fmt: skip
    """Every barrier, direction and phase, sorted in the order given.

    What is survived without a barrier is where the searches with one begin.

    Raises:
        PdhocbfError: a worker process died.
    """
    text = scenario.model_dump_json()
    found: dict[tuple[str, str, int], float] = {}
    likely = {direction: _LIKELY[direction] * mass / _LIKELY_MASS for direction in directions}
    waves = [[b for b in barriers if b == NONE], [b for b in barriers if b != NONE]]
    for wave in waves:
        work = []
        for barrier in wave:
            for phase in phases:
                guesses = {way: found.get((NONE, way, phase), likely[way]) for way in directions}
                work.append(Search(text, barrier, tuple(phases), phase, guesses, settings))
        for impulses in _shared(work, workers):
            found.update({impulse[:3]: impulse.survived for impulse in impulses})
            if tell is not None:
                tell(len(found))
    order = [(b, d, p) for b in barriers for d in directions for p in phases]
    return [Impulse(*key, found[key]) for key in order]


def _shared(work: Sequence[Search], workers: int):  # type: ignore[no-untyped-def]
    if workers == 1 or len(work) < 2:
        yield from map(search, work)
        return
    with ProcessPoolExecutor(min(workers, len(work)), mp_context=get_context("spawn")) as pool:
        futures = [pool.submit(search, piece) for piece in work]
        try:
            for future in as_completed(futures):
                yield future.result()
        except BrokenProcessPool:
            raise PdhocbfError("a worker process died; with --workers 1 everything runs in this one") from None
        finally:
            pool.shutdown(wait=True, cancel_futures=True)
