"""Values of the legs' joints in a robot file: one for all, six by role, or those of each side."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from pydantic import ValidationError, WrapValidator

from pdhocbf_drake.config import Config, limited

ROLES = ("hip_yaw", "hip_roll", "hip_pitch", "knee_pitch", "ankle_pitch", "ankle_roll")
Roles = float | tuple[float, float, float, float, float, float]


class BothSides(Config):
    """Values that differ between the legs: each side has one number for all joints, or six in the order of `ROLES`."""

    left: Roles
    right: Roles


PerJoint = Roles | BothSides


def per_joint(value: PerJoint) -> np.ndarray:
    """The value as twelve numbers, left leg then right, each in the order of `ROLES`."""
    sides = (value.left, value.right) if isinstance(value, BothSides) else (value, value)
    return np.concatenate([np.broadcast_to(np.asarray(side, dtype=float), len(ROLES)) for side in sides])


def per_joint_within(low: float, high: float, unit: str, *, above: bool = False) -> WrapValidator:
    """Checks each number of a per-joint value; the error is one sentence."""
    allowed = limited(low, high, unit, above=above)

    def check(value: Any, parse: Callable[[Any], Any]) -> Any:
        try:
            parsed = parse(_strict(value))
        except ValidationError:
            text = f"must be one number for all joints, or six: {', '.join(ROLES)}; or a map of left and right to such"
            raise ValueError(f"{text}{_wrong_sides(value)}") from None
        for joint, number in [] if parsed is None else _by_joint(parsed):
            try:
                allowed(number)
            except ValueError as error:
                raise ValueError(f"{error}{f', and {joint} has {number:g}' if joint else ''}") from None
        return parsed

    return WrapValidator(check)


def _by_joint(value: PerJoint) -> list[tuple[str, float]]:
    """Each number with the joint that it belongs to, which is empty where one holds for all."""
    sides = {"left ": value.left, "right ": value.right} if isinstance(value, BothSides) else {"": value}
    return [
        (f"{side}{role}".strip(), float(number))
        for side, own in sides.items()
        for role, number in (zip(ROLES, own, strict=True) if isinstance(own, tuple) else [("", own)])
    ]


def _wrong_sides(value: Any) -> str:
    """What is wrong with the keys of a map, in words."""
    if not isinstance(value, dict):
        return ""
    unknown = [f"{key!r} is no side" for key in value if key not in BothSides.model_fields]
    missing = [f"{side} is missing" for side in BothSides.model_fields if side not in value]
    wrong = [f"{side} is {given}" for side, given in value.items() if not _fits(given)]
    return "".join(f", and {said}" for said in (unknown or missing or wrong)[:1])


def _fits(value: Any) -> bool:
    """Whether a side has one number or six."""
    numbers = value if isinstance(value, list | tuple) and len(value) == len(ROLES) else [value]
    return all(isinstance(number, int | float) and math.isfinite(number) for number in numbers)


def _strict(value: Any) -> Any:
    """Lists as the tuples that strict validation of Python's values wants."""
    if isinstance(value, dict):
        return {side: _strict(entry) for side, entry in value.items()}
    return tuple(value) if isinstance(value, list) else value
