"""The rows of the table: what of a joint's peak in the scenario's walk it may have, and what the ground carries."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from pdhocbf_drake.robot import ROLES

DEFAULT: Final = "the walk itself"
BARRIERS: Final = "joint barriers"
PROGRAM: Final = "program"


class Row(NamedTuple):
    """A walk at a limit.

    Attributes:
        torque, speed: role and share of its peak that it may have.
        changes: keys of the scenario.
        fastest: least share of the commanded speed [%]; None where a slower walk, or a refusal, is right.
        duration: of the walk [s].
        slip: farthest that a sole may move in a step [mm].
    """

    torque: tuple[str, float] | None = None
    speed: tuple[str, float] | None = None
    changes: dict[str, Any] | None = None
    fastest: float | None = 90.0
    duration: float = 20.0
    slip: float | None = None


def _on_ice(friction: float, fastest: float | None, **changes: Any) -> Row:
    return Row(changes={"friction": friction, **changes}, fastest=fastest, duration=30.0, slip=5.0)


_TURNING = [{"time": 0.8, "velocity": [0.375, 0.0], "turn": 0.3}]

ROWS: Final[dict[str, Row]] = {
    DEFAULT: Row(fastest=98.0),
    **{f"{role} torque 80 %": Row(torque=(role, 0.8)) for role in ROLES},
    **{f"{role} torque 60 %": Row(torque=(role, 0.6), fastest=None) for role in ROLES},
    **{f"{role} speed 80 %": Row(speed=(role, 0.8)) for role in ("hip_pitch", "knee_pitch", "ankle_pitch")},
    "friction 0.2": _on_ice(0.2, 98.0),
    "friction 0.1": _on_ice(0.1, 98.0),
    "friction 0.06": _on_ice(0.06, None),
    "friction 0.1, turning": _on_ice(0.1, None, commands=_TURNING),
}
"""Walks by name, in the order of the table."""
