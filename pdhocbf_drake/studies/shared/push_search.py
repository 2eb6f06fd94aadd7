"""The largest impulse that is survived, by bisection, for each barrier, direction and phase, shared among processes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache, partial
from itertools import product
from typing import NamedTuple

from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.shared.cases import NONE, in_case
from pdhocbf_drake.studies.shared.events import force
from pdhocbf_drake.studies.shared.pool import in_processes
from pdhocbf_drake.studies.shared.pushing import PushedWalk

_LIMIT = 60.0  # [N s]
# Impulses that a robot of this mass is likely to survive, at which the search begins [N s], [kg].
_LIKELY, _LIKELY_MASS = {"+x": 16.0, "-x": 16.0, "+y": 8.0, "-y": 8.0}, 29.0


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
    """The searches in all directions at one phase, each from a guess [N s]: one piece of work for a process."""

    scenario: str
    barrier: str
    phases: tuple[int, ...]
    phase: int
    guesses: dict[str, float]
    settings: Settings


def search_all(
    scenario: Scenario, barriers: Sequence[str], directions: Sequence[str], phases: Sequence[int],
    settings: Settings, workers: int, mass: float = _LIKELY_MASS,
) -> Iterator[list[Impulse]]:  # fmt: skip
    """The largest survived impulse for every barrier, direction and phase, yielded as they are found.

    The searches with a barrier begin from the impulse that is survived without one.

    Args:
        scenario: the scenario. barriers: some of `CASES`.
        directions: some of `DIRECTIONS`. phases: ticks of the gait.
        settings: shared by all searches.
        workers: number of processes.
        mass: of the robot, from which the first guesses are scaled [kg].

    Raises:
        PdhocbfError: a worker process died.
    """
    text = scenario.model_dump_json()
    found: dict[tuple[str, str, int], float] = {}
    for wave in ([b for b in barriers if b == NONE], [b for b in barriers if b != NONE]):
        work = []
        for barrier, phase in product(wave, phases):
            guesses = {d: found.get((NONE, d, phase), _LIKELY[d] * mass / _LIKELY_MASS) for d in directions}
            work.append(Search(text, barrier, tuple(phases), phase, guesses, settings))
        for impulses in in_processes(search, work, workers):
            found.update({impulse[:3]: impulse.survived for impulse in impulses})
            yield impulses


def search(work: Search) -> list[Impulse]:
    """The largest survived impulse in each direction at one phase."""
    walk, settings = _walk(work.scenario, work.barrier, work.phases), work.settings

    def survives(direction: str, impulse: float) -> bool:
        pushed = force(direction, impulse, settings.duration)
        return walk.trial(work.phase, pushed, settings.duration, settings.watch).survived

    found = {
        direction: largest_survived(partial(survives, direction), guess, settings.tolerance, _LIMIT)
        for direction, guess in work.guesses.items()
    }
    return [Impulse(work.barrier, direction, work.phase, impulse) for direction, impulse in found.items()]


@lru_cache(maxsize=1)  # keyed by value: a worker gets the same walk again for its next phase
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
