"""The ground under a standing foot, where that is not level or not where the other foot stands."""

from __future__ import annotations

import math

import numpy as np

_TILT, _HEIGHT = 0.015, 0.004  # by which a sole may be off before the ground is taken to be there [rad, m]
_TILTS, _HEIGHTS = slice(0, 2), slice(2, 3)
_LEVEL = [0.0, 0.0, 0.0]


def meet(ground: np.ndarray, side: int, seen: np.ndarray) -> np.ndarray:
    """What a standing sole is to be corrected to; writes it into the row of its foot.

    A foot that comes down stands on level ground at height 0, or as the other foot does, if that is where it is seen;
    else the ground is taken for what is seen. So it is, too, where a foot that stands is seen elsewhere than before.

    Args:
        ground: x and y of the normal, and height, under the left and the right foot (2, 3) [1, 1, m].
        side: 0 left, 1 right.
        seen: the same by the estimate (3,).
    """
    own, other, found = ground[side].tolist(), ground[1 - side].tolist(), seen.tolist()
    for part, most in ((_TILTS, _TILT), (_HEIGHTS, _HEIGHT)):
        before = (_LEVEL, other) if math.isnan(own[part.start]) else (own,)
        nearest = min(before, key=lambda one, part=part: _off(found[part], one[part]))
        own[part] = nearest[part] if _off(found[part], nearest[part]) <= most else found[part]
    ground[side] = own
    return ground[side]


def _off(seen: list[float], before: list[float]) -> float:
    """Largest distance; infinite from a foot that hasn't come to the ground."""
    off = [abs(a - b) for a, b in zip(seen, before, strict=True)]
    return math.inf if any(map(math.isnan, off)) else max(off)
