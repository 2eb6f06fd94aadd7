"""What is found where a walk is checked against its robot."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

Level = Literal["ok", "note", "fault"]


class Finding(NamedTuple):
    """One check.

    Attributes:
        check: its name. level: a note may walk all the same.
        key: the entries of scenario or robot file that it is about.
        said: what was found. fix: what to do; empty where all is well.
    """

    check: str
    level: Level
    key: str
    said: str
    fix: str = ""

    def __str__(self) -> str:
        return f"{self.check}: {self.cure}"

    @property
    def cure(self) -> str:
        """What was found, the entries that it is about, and what to do."""
        return f"{self.said} ({self.key})" + (f"; {self.fix}" if self.fix else "")

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        return self._asdict()


def level_of(value: float, good: float, most: float) -> Level:
    """Well up to `good`, to be noted up to `most`, a fault above it; NaN is a fault."""
    if value <= good:
        return "ok"
    return "note" if value <= most else "fault"
