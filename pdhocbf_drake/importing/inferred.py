"""What importing a robot found out: each fact with its source and how sure it is."""

from __future__ import annotations

from typing import Literal, NamedTuple

Sure = Literal["given", "certain", "likely", "guess"]


class Inferred(NamedTuple):
    """One fact about a robot.

    Attributes:
        what: its name. value: as text, with its unit.
        source: what it was inferred from.
        sure: "given" by a flag; "certain": it follows from the model; "likely": the usual case; "guess": try others.
    """

    what: str
    value: str
    source: str
    sure: Sure = "certain"


def listed(names: object) -> str:
    """Names for a message, in their order."""
    return ", ".join(str(name) for name in names) or "none"  # type: ignore[attr-defined]
