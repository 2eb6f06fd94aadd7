"""Values of the legs' joints in a robot file: one for all, six by role, or those of each side."""

from __future__ import annotations

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
            raise ValueError(text) from None
        for number in () if parsed is None else per_joint(parsed):
            allowed(float(number))
        return parsed

    return WrapValidator(check)


def _strict(value: Any) -> Any:
    """Lists as the tuples that strict validation of Python's values wants."""
    if isinstance(value, dict):
        return {side: _strict(entry) for side, entry in value.items()}
    return tuple(value) if isinstance(value, list) else value
