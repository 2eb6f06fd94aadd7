"""How much of the workers' time a campaign simulates."""

from __future__ import annotations

import time
from typing import Any


class Pace:
    """Time from the first run that is handed out to the last row.

    Attributes:
        workers: runs at a time.
    """

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self._started = self._last = time.monotonic()
        self._simulating = 0.0

    def row(self, simulating: float) -> None:
        """Counts a run whose row is written, and the time that it simulated [s]."""
        self._last = time.monotonic()
        self._simulating += simulating

    def summary(self) -> dict[str, Any]:
        """The times [s] and share [1] of campaign.json; the share is null without a row."""
        seconds = self._last - self._started
        share = self._simulating / (self.workers * seconds) if seconds else None
        return {
            "seconds": seconds,
            "workers": self.workers,
            "simulating_seconds": self._simulating,
            "simulating_share": share,
        }
