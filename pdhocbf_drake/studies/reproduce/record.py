"""What a part of the reproduction hands over: numbers beside the paper's, pictures with their data, sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from pdhocbf_drake.errors import InputError


class Number(NamedTuple):
    """One number of the paper beside ours: a row of `results.json`.

    Attributes:
        name: what it is.
        paper: the paper's value; None where the paper has none.
        ours: our value, in the same unit.
        unit: of both.
        tolerance: largest |ours − paper| that counts as reproduced [unit]; None where no agreement is claimed.
        calibrated: True where something that the paper leaves out was chosen so that this number comes out.
        command: what makes it.
    """

    name: str
    paper: float | None
    ours: float
    unit: str
    tolerance: float | None
    calibrated: bool
    command: str

    @property
    def agrees(self) -> bool | None:
        """Whether ours is within the tolerance; None where no agreement is claimed."""
        if self.paper is None or self.tolerance is None:
            return None
        return bool(abs(self.ours - self.paper) <= self.tolerance)


class Picture(NamedTuple):
    """A figure and the numbers drawn in it.

    Attributes:
        name: file name without ending.
        caption: what to see in it.
        figure: a matplotlib figure.
        data: columns of equal length by name, with the unit in the name; they become the CSV.
    """

    name: str
    caption: str
    figure: Figure
    data: Mapping[str, ArrayLike]

    def table(self) -> tuple[list[str], list[list[Any]]]:
        """Header and rows of the CSV.

        Raises:
            InputError: columns of different lengths.
        """
        columns = [np.asarray(column).ravel() for column in self.data.values()]
        if len({len(column) for column in columns}) > 1:
            raise InputError(f"figure {self.name}: all columns of its data need one length")
        return list(self.data), [list(row) for row in zip(*(column.tolist() for column in columns), strict=True)]


class Table(NamedTuple):
    """A small table for the report; the cells are text."""

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass
class Section:
    """A part of the report.

    Attributes:
        title: its heading.
        text: paragraphs.
        pictures, tables, numbers: in the order in which they are shown.
        finding: the one sentence to take away.
        frames: whole HTML pages to embed (a replay), by title.
    """

    title: str
    text: list[str] = field(default_factory=list)
    pictures: list[Picture] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    numbers: list[Number] = field(default_factory=list)
    finding: str = ""
    frames: dict[str, str] = field(default_factory=dict)
