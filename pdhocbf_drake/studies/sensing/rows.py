"""The rows of the table: what differs from an exact measurement and an exact model, and what must be reached then."""

from __future__ import annotations

from typing import Any, Final, NamedTuple


class Row(NamedTuple):
    """A way to be wrong about the robot.

    Attributes:
        changes: keys of the scenario.
        speed: least share of the commanded speed; None judges falls alone [%].
        zmp: most percentage points of ticks with the ZMP outside its box, more than in an exact walk; None is no limit.
        duration: of the walk [s].
    """

    changes: dict[str, Any]
    speed: float | None = None
    zmp: float | None = None
    duration: float = 12.0


def _late(true: int, stated: int) -> Row:
    return Row({"measurement": {"delay_ticks": true}, "mpc": {"delay": stated}})


def _wrong(**changes: Any) -> Row:
    return Row(changes, 97.0, 3.0)


EXACT: Final = "exact"
_WEIGHED: Final = {"weigh": True}
ROWS: Final[dict[str, Row]] = {
    EXACT: Row({}, 98.0),
    **{f"late {10 * d} ms": Row({"measurement": {"delay_ticks": d}}, 98.0) for d in (1, 2, 3, 4)},
    **{f"late {10 * d} ms, stated {10 * s}": _late(d, s) for d, s in ((1, 0), (1, 2), (2, 1), (2, 3), (4, 3), (4, 5))},
    **{f"torso {m:g}": _wrong(model_error={"torso_mass": m}, biped=_WEIGHED) for m in (0.8, 1.2, 1.3)},
    "CoM ahead": _wrong(model_error={"com_shift": [0.02, 0.0, 0.0]}, biped=_WEIGHED),
    "CoM behind": _wrong(model_error={"com_shift": [-0.02, 0.0, 0.0]}, biped=_WEIGHED),
    "CoM aside": _wrong(model_error={"com_shift": [0.0, 0.02, 0.0]}, biped=_WEIGHED),
    "torso 1.3, not weighed": Row({"model_error": {"torso_mass": 1.3}}, 97.0),
    "CoM ahead, not weighed": Row({"model_error": {"com_shift": [0.02, 0.0, 0.0]}}, 97.0),
    "slope": _wrong(model_error={"gravity_tilt_deg": [2.0, 0.0]}),
    "wind": _wrong(wind=[-10.0, 0.0]),
    "noise": Row({"measurement": {"noise": {"com": 0.005, "velocity": 0.05}}}, 97.0, None, 60.0),
    "noise, late": Row(
        {"measurement": {"noise": {"com": 0.005, "velocity": 0.05}, "delay_ticks": 1}}, 97.0, None, 60.0
    ),
}
"""By name, in the order of the table."""
