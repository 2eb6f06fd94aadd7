"""The largest impulse that is survived, by bisection."""

from __future__ import annotations

from collections.abc import Callable


def largest_survived(survives: Callable[[float], bool], guess: float, tolerance: float, limit: float) -> float:
    """A multiple of `tolerance` that is survived while the next one is not, at most `limit` [N s].

    Grows from a guess until a survived and a deadly impulse enclose the answer, then halves what lies between. What a
    robot survives need not be an interval: a push that happens to meet a favourable step may be survived above one
    that is not. The search then gives one of the edges, the one next to the guess as a rule.

    Args:
        survives: says of an impulse whether it is survived; zero is taken to be.
        guess: where to begin [N s].
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
