"""The largest disturbance under which a periodic system still has invariant sets."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.sets.invariant_set import InvariantSet
from pdhocbf_drake.sets.polytope import Polytope

TOLERANCE = 1e-3
"""Of the largest multiple, as a share of it."""

_DOUBLINGS = 40  # and as many halvings

MOST = 1e6
"""The largest half-width that is taken [unit of its state]."""

Solve = Callable[[float, tuple[Polytope, ...]], InvariantSet]


@dataclass(frozen=True)
class Largest:
    """The largest λ for which invariant sets under λ W exist, by bisection.

    There are sets at `scale`, and none at scale · (1 + `TOLERANCE`). Where it is not decided whether there are any,
    because the iteration does not end, there are none.

    Attributes:
        scale: λ; 0 where even the smallest disturbance that was tried leaves none, or no disturbance does.
        sets: those at λ; None where it is 0.
        solved: for how many multiples sets were computed.
    """

    scale: float
    sets: InvariantSet | None
    solved: int


def largest_disturbance(
    solve: Solve, known: Sequence[tuple[float, InvariantSet]] = (), tolerance: float = TOLERANCE
) -> Largest:
    """Bisects for the largest multiple.

    Args:
        solve: the invariant sets under λ W within the given limits, or within the system's own where none are given.
            Sets under a smaller multiple hold all those under a larger one, so that the search goes on from them.
        known: multiples whose sets are known.
        tolerance: of the multiple, as a share of it.
    """
    low, high, solved = 0.0, float("inf"), 0
    sets: InvariantSet | None = None
    for scale, found in known:
        if not found.enforceable:
            high = min(high, scale)
        elif scale >= low:
            low, sets = scale, found
    if high == 0.0:
        return Largest(0.0, None, 0)
    guess = low or min(1.0, high)
    for _ in range(2 * _DOUBLINGS):
        if low > 0.0 and high <= low * (1.0 + tolerance):
            break
        if high == float("inf"):
            guess *= 2.0 if low else 1.0
        else:
            guess = 0.5 * (low + high) if low else 0.5 * high
        there = _solved(solve, guess, () if sets is None else sets.sets)
        solved += 1
        if there is None:
            high = guess
        else:
            low, sets = guess, there
        if high < 2.0**-_DOUBLINGS or low > 2.0**_DOUBLINGS:
            break
    return Largest(low, sets if low else None, solved)


def _solved(solve: Solve, scale: float, within: tuple[Polytope, ...]) -> InvariantSet | None:
    """The sets under a multiple; None where there are none, or none are found."""
    for start in (within, ()) if within else ((),):
        try:
            found = solve(scale, start)
        except InputError:  # no fixed point within the sweeps, or one that is lost to rounding
            continue
        return found if found.enforceable else None
    return None


def checked_half_widths(given: Sequence[float], count: int, which: str) -> tuple[float, ...]:
    """Half-widths of a box of disturbances; raises `InputError`, with `which` they are, for what can't be one."""
    sides = tuple(float(side) for side in given)
    if len(sides) != count or not all(0.0 <= side <= MOST for side in sides):
        raise InputError(
            f"a disturbance is {count} half-widths from 0 to {MOST:g} a tick ({which}), given "
            f"{' '.join(f'{side:g}' for side in sides)}"
        )
    return sides
