"""What a user says of a model that it does not say itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class Given:
    """What a user says of a model.

    Attributes:
        base: the link that floats. left_foot, right_foot: links of the feet.
        left_joints, right_joints: names of the six joints in the order of `ROLES`.
        forward: the axis of the base that points ahead, a key of `directions.NAMES`.
        up: that which points up, None to find it.
        fixed: angles of joints beyond the legs [rad]; the others are fixed at zero.
        effort: greatest torque of joints of which the model says none [N m].
        packages: folders of `package://` names.
    """

    base: str | None = None
    left_foot: str | None = None
    right_foot: str | None = None
    left_joints: Sequence[str] | None = None
    right_joints: Sequence[str] | None = None
    forward: str | None = None
    up: str | None = None
    fixed: Mapping[str, float] = field(default_factory=dict)
    effort: float | None = None
    packages: Mapping[str, Path] = field(default_factory=dict)
