"""Colours: one per quantity, the same in every figure, table and replay.

The hues are those of Okabe and Ito, which stay apart for every kind of colour blindness. Measured and planned differ in
line style too.
"""

from __future__ import annotations

from typing import Final

MEASURED_COM: Final = "#000000"
PLANNED_COM: Final = "#56B4E9"
MEASURED_ZMP: Final = "#CC79A7"
PLANNED_ZMP: Final = "#7B3264"
LEFT: Final = "#0072B2"
RIGHT: Final = "#D55E00"
BOX: Final = "#C8C8C8"
LIMIT: Final = "#555555"
PUSH: Final = "#F0E442"
BARRIERS: Final = ("#009E73", "#E69F00", "#0072B2", "#D55E00")
RUNS: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
CASES: Final = {"none": RUNS[3], "DCBF": BARRIERS[1], "P-DHOCBF": BARRIERS[0]}  # the cases that studies compare
JOINTS: Final = ("#0072B2", "#56B4E9", "#009E73", "#E69F00", "#D55E00", "#CC79A7")

Rgb = tuple[float, float, float]

# Green and red of the same set; blue against orange-red in effect, so that the marker reads without colour vision too.
SAFE: Final = "#009E73"
UNSAFE: Final = "#D55E00"


def case_colour(name: str, place: int) -> str:
    """The colour of a compared case: that of `CASES`, or for another name one by its place in the comparison."""
    return CASES.get(name, RUNS[place % len(RUNS)])


def barrier_colour(column: int) -> str:
    """The colour of the barrier in a column of the signal `h`."""
    return BARRIERS[column % len(BARRIERS)]


def rgb(colour: str) -> Rgb:
    """The red, green and blue parts of "#RRGGBB" in [0, 1]."""
    red, green, blue = (value / 255.0 for value in bytes.fromhex(colour[1:]))
    return red, green, blue


def safety_colour(h: float, safe: float) -> Rgb:
    """From red at h ≤ 0 to green at h ≥ `safe`, both in the barrier's unit."""
    share = min(1.0, max(0.0, h / safe)) if safe > 0 else float(h > 0)
    red, green, blue = (low + share * (high - low) for low, high in zip(rgb(UNSAFE), rgb(SAFE), strict=True))
    return red, green, blue
