"""Sections of the reproduction (numbers beside the paper's, pictures with their data, tables, text) and their page.

The page loads nothing; the PNG and CSV of every figure lie beside it.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

import pdhocbf_drake
from pdhocbf_drake.analysis.page import data_url, filled_page, png
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.files.file import replaced_file, write_text
from pdhocbf_drake.files.pages import page
from pdhocbf_drake.studies.shared.cases import DCBF, NONE, PERIODIC
from pdhocbf_drake.studies.shared.results import write_json

REPORT: Final = "report.html"
RESULTS: Final = "results.json"
FIGURES: Final = "figures"

LABELS: Final = {NONE: "no barrier", DCBF: "Case 1, DCBF", PERIODIC: "Case 2, P-DHOCBF"}
STYLES: Final = {NONE: ":", DCBF: "--", PERIODIC: "-"}
"""Label and line style of each case; its colour is that of `palette.CASES`."""


class Number(NamedTuple):
    """A number of the paper beside ours: a row of `results.json`.

    Attributes:
        name: its name.
        paper: the paper's value; None where the paper has none.
        ours: our value, in the same unit.
        unit: of both.
        tolerance: largest |ours − paper| that counts as reproduced [unit]; None where no agreement is claimed.
        calibrated: True where a value that the paper leaves out was fitted to this number.
        command: the command that prints it; empty for the one that makes its section.
    """

    name: str
    paper: float | None
    ours: float
    unit: str
    tolerance: float | None = None
    calibrated: bool = False
    command: str = ""

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
        caption: the sentence below it.
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
    """A small table for the report: rows of text cells by column, all with the columns of the first row."""

    caption: str
    rows: Sequence[Mapping[str, str]]


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


def write_report(sections: Mapping[str, Section], folder: Path, seconds: float) -> None:
    """Writes `report.html`, `results.json` and `figures/*.png|csv`; `seconds`: time spent.

    A picture that can't be drawn is left out, with a `PageWarning`.
    """
    numbers = [number for section in sections.values() for number in section.numbers]
    write_json(folder / RESULTS, [number._asdict() for number in numbers], indent=2)
    shown = []
    for key, section in sections.items():
        pictures = []
        for picture in section.pictures:
            with page(picture.name):
                header, rows = picture.table()
                text = io.StringIO(newline="")
                csv.writer(text).writerows([header, *rows])
                write_text(folder / FIGURES / f"{picture.name}.csv", text.getvalue())
                image = png(picture.figure)
                with replaced_file(folder / FIGURES / f"{picture.name}.png") as staging:
                    staging.write_bytes(image)
                pictures.append({"caption": picture.caption, "name": picture.name, "source": data_url(image)})
        shown.append({"key": key, "section": section, "pictures": pictures})
    filled = filled_page(
        "studies.reproduce",
        {"value": value, "agreement": agreement},
        shown=shown,
        paper=[number for number in numbers if number.paper is not None],
        version=pdhocbf_drake.__version__,
        minutes=seconds / 60,
    )
    write_text(folder / REPORT, filled)


def value(number: float | None) -> str:
    """A number with four significant digits; a dash for none."""
    return "–" if number is None else f"{number:.4g}"


def agreement(number: Number) -> str:
    """Whether ours agrees with the paper's number, and within what; a dash where no agreement is claimed."""
    if number.paper is None or number.tolerance is None:
        return "–"
    unit = "" if number.unit == "1" else f" {number.unit}"
    allowed = f"within {value(number.tolerance)}{unit}" if number.tolerance else "exactly"
    return f"yes, {allowed}" if number.agrees else f"no, off by {value(abs(number.ours - number.paper))}{unit}"
