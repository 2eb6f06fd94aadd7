"""Where a model's up, left and ahead are, with all joints at zero."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.importing.feet import Limb, limb_centre
from pdhocbf_drake.importing.inferred import Inferred, Sure
from pdhocbf_drake.importing.parsed import ParsedModel
from pdhocbf_drake.importing.roles import Axes, Leg

_NEAR = np.cos(np.deg2rad(10.0))  # directions nearer than that to an axis of the base are that axis
_ONE_SIDED = 0.2  # of a knee's range, which is 1 where it bends one way alone
_TOES = 0.1  # by which a foot reaches further ahead of its ankle than behind it, as a share of its length
NAMES = {"x": (1, 0, 0), "-x": (-1, 0, 0), "y": (0, 1, 0), "-y": (0, -1, 0), "z": (0, 0, 1), "-z": (0, 0, -1)}


class Facing(NamedTuple):
    """The direction ahead (3,), and what says so."""

    ahead: np.ndarray
    fact: Inferred


def side_to_side(model: ParsedModel, limbs: tuple[Limb, Limb], up: np.ndarray) -> Axes:
    """Axes whose left is along the line between the feet; which of its two ways is open."""
    one, other = (limb_centre(model, limb) for limb in limbs)
    across = one - other - (one - other) @ up * up
    if np.linalg.norm(across) < 1e-6:
        raise ModelError(f"the feet {limbs[0].name} and {limbs[1].name} stand in one place, with all joints at zero")
    left = _near_axis(across / np.linalg.norm(across))
    return Axes(up, left, np.cross(left, up))


def facing(model: ParsedModel, legs: tuple[Leg, Leg], axes: Axes, given: str | None, left_foot: str | None) -> Facing:
    """The direction ahead: given, or where the knees bend to, or where the left foot or the toes say it is.

    A knee with axis a that turns further the way s moves the foot back, so  ahead = s (a × up).

    Raises:
        ModelError: nothing of this says which of the two ways it is.
    """
    both = axes.ahead
    if given is not None:
        ahead = np.array(NAMES[given], dtype=float)
        if abs(ahead @ both) < _NEAR:
            raise ModelError(
                f"--forward {given} is not across the line between the feet; {word(both)} or {word(-both)} is"
            )
        return Facing(ahead, _fact(ahead, "--forward", "given"))
    knees = [_bend(model, leg, axes.up) @ both for leg in legs]
    if min(map(abs, knees)) > _ONE_SIDED and knees[0] * knees[1] > 0:
        ahead = both * np.sign(knees[0])
        return Facing(ahead, _fact(ahead, "the way the knees bend", "certain"))
    if left_foot is not None:
        first = legs[0].limb
        is_left = left_foot in [body.name() for body in first.bodies]
        across = (limb_centre(model, first) - limb_centre(model, legs[1].limb)) @ axes.left
        left = axes.left * np.sign(across) * (1 if is_left else -1)
        ahead = np.cross(left, axes.up)
        return Facing(ahead, _fact(ahead, "--left-foot", "given"))
    toes = [_reach(model, leg, both) for leg in legs]
    if min(map(abs, toes)) > _TOES and toes[0] * toes[1] > 0:
        ahead = both * np.sign(toes[0])
        return Facing(ahead, _fact(ahead, "the feet's longer end, since the knees bend both ways", "guess"))
    raise ModelError(
        "the knees bend both ways, and the feet are as long behind the ankles as before them: give --forward with "
        f"{word(both)} or {word(-both)}, an axis of the base"
    )


def _bend(model: ParsedModel, leg: Leg, up: np.ndarray) -> np.ndarray:
    """The direction ahead by a knee, whose length says how one-sided its range is, in [0, 1]."""
    knee = leg.joints["knee_pitch"]
    low, high = float(knee.position_lower_limit()), float(knee.position_upper_limit())
    if not np.isfinite([low, high]).all() or high <= low:
        return np.zeros(3)
    side = np.clip((high + low) / (high - low), -1.0, 1.0)
    return np.asarray(side * np.cross(model.axis(knee), up))


def _reach(model: ParsedModel, leg: Leg, ahead: np.ndarray) -> float:
    """How much further a foot reaches ahead of its ankle than behind, as a share of its length."""
    foot = min((model.moved_by(leg.joints[role]) for role in ("ankle_pitch", "ankle_roll")), key=len)
    along = (model.points(foot) - model.place(leg.joints["ankle_pitch"])) @ ahead
    return float((along.max() + along.min()) / max(along.max() - along.min(), 1e-9))


def _near_axis(direction: np.ndarray) -> np.ndarray:
    for axis in NAMES.values():
        if direction @ axis > _NEAR:
            return np.array(axis, dtype=float)
    return direction


def word(direction: np.ndarray) -> str:
    """An axis of the base for a message, or the direction's coordinates."""
    for name, axis in NAMES.items():
        if direction @ axis > _NEAR:
            return name
    return f"[{' '.join(f'{x:.2f}' for x in direction)}]"


def _fact(ahead: np.ndarray, source: str, sure: Sure) -> Inferred:
    return Inferred("ahead", f"{word(ahead)} of the base", source, sure)
