"""The largest impulse that is survived, by bisection, for each barrier, direction and phase, shared among processes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from itertools import product
from typing import NamedTuple

from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.shared.cases import CASES, NONE, in_case
from pdhocbf_drake.studies.shared.events import force
from pdhocbf_drake.studies.shared.pool import in_processes
from pdhocbf_drake.studies.shared.pushing import PushedWalk

# Impulses that a robot of this mass is likely to survive, at which a search begins, and most that it tries [N s], [kg].
_LIKELY, _LIKELY_MASS = {"+x": 16.0, "-x": 16.0, "+y": 8.0, "-y": 8.0}, 29.0
_MOST = 60.0

_MIRRORED = {"+x": "+x", "-x": "-x", "+y": "-y", "-y": "+y"}


class Impulse(NamedTuple):
    """The largest survived impulse [N s] in one direction, from one tick of the gait on, under one barrier."""

    barrier: str
    direction: str
    phase: int
    survived: float


class Settings(NamedTuple):
    """Shared by all searches of a command: resolution [N s], length of a push [s], time simulated from it on [s]."""

    tolerance: float
    duration: float
    watch: float


class Search(NamedTuple):
    """The search in one direction at one of the phases, from a guess up to a limit [N s]: one piece of work."""

    scenario: str
    barrier: str
    direction: str
    phases: tuple[int, ...]
    phase: int
    guess: float
    limit: float
    settings: Settings


def search_all(
    scenario: Scenario, barriers: Sequence[str], directions: Sequence[str], phases: Sequence[int],
    settings: Settings, workers: int, mass: float = _LIKELY_MASS,
) -> Iterator[list[Impulse]]:  # fmt: skip
    """The largest survived impulse for every barrier, direction and phase, yielded as they are found.

    A search in the second step of the gait begins from what is survived in its first one with left and right exchanged,
    and a search with a barrier from what is survived without one.

    Args:
        scenario: the scenario. barriers: some of `CASES`.
        directions: some of `DIRECTIONS`. phases: ticks of the gait.
        settings: shared by all searches.
        workers: number of processes.
        mass: of the robot, with which guesses and limits are scaled [kg].

    Raises:
        PdhocbfError: a worker process died.
    """
    first = [NONE] if NONE in barriers else barriers
    text, at, step = scenario.model_dump_json(), tuple(phases), scenario.gait.ticks_per_step
    wanted = set(product(directions, at))

    def piece(barrier: str, direction: str, phase: int, guess: float) -> Search:
        return Search(text, barrier, direction, at, phase, guess, _MOST * mass / _LIKELY_MASS, settings)

    def then(found: Impulse) -> list[Search]:
        if found.barrier not in first:
            return []
        mirrored = _MIRRORED[found.direction], found.phase + step
        others = [b for b in barriers if b not in first]
        return [
            *([piece(found.barrier, *mirrored, found.survived)] if mirrored in wanted else []),
            *[piece(barrier, found.direction, found.phase, found.survived) for barrier in others],
        ]

    work = [
        piece(barrier, way, phase, _LIKELY[way] * mass / _LIKELY_MASS)
        for barrier, phase, way in product(first, at, directions)
        if (_MIRRORED[way], phase - step) not in wanted
    ]
    for impulse in in_processes(search, work, workers, then):
        yield [impulse]


def search(work: Search) -> Impulse:
    """The largest survived impulse in one direction at one phase."""
    walk, settings = _walk(work.scenario, work.barrier, work.phases), work.settings

    def survives(impulse: float) -> bool:
        pushed = force(work.direction, impulse, settings.duration)
        return walk.trial(work.phase, pushed, settings.duration, settings.watch, whole=False).survived

    found = largest_survived(survives, work.guess, settings.tolerance, work.limit)
    return Impulse(work.barrier, work.direction, work.phase, found)


@lru_cache(maxsize=len(CASES))  # keyed by value: a worker gets the same walk again for its next search
def _walk(scenario: str, barrier: str, phases: tuple[int, ...]) -> PushedWalk:
    return PushedWalk(in_case(Scenario.model_validate_json(scenario), barrier), phases)


def largest_survived(survives: Callable[[float], bool], guess: float, tolerance: float, limit: float) -> float:
    """A multiple of `tolerance` that is survived while the next one is not, at most `limit` [N s].

    Grows from a guess until a survived and a deadly impulse enclose the answer, then bisects. The survived impulses
    need not be an interval, since a larger push may meet a more favourable step; the search then returns one of the
    edges, as a rule the one next to the guess.

    Args:
        survives: whether an impulse is survived; zero is taken to be.
        guess: the first impulse to try [N s].
        tolerance: distance between neighbouring impulses [N s].
        limit: no impulse above it is tried [N s].
    """
    most = int(limit / tolerance)
    low, high = 0, most + 1
    reach, at = 1, min(max(round(guess / tolerance), 1), most)
    while high - low > 1:
        if survives(at * tolerance):
            low = at
            at = min(low + reach, most) if high > most else (low + high) // 2
        else:
            high = at
            at = max(high - reach, 1) if low == 0 else (low + high) // 2
        reach *= 2
        if high > low + 1:
            at = min(max(at, low + 1), high - 1)
    return low * tolerance
