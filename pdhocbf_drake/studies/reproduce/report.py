"""Binds the sections into one page that loads nothing, with every figure's PNG and CSV and every number beside it."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import pdhocbf_drake
from pdhocbf_drake.analysis.page import data_url, page, png
from pdhocbf_drake.studies.reproduce.record import Number, Section

REPORT: Final = "report.html"
RESULTS: Final = "results.json"
FIGURES: Final = "figures"


def results(sections: Mapping[str, Section]) -> list[dict[str, Any]]:
    """The rows of `results.json`."""
    return [_row(number) for section in sections.values() for number in section.numbers]


def write_report(sections: Mapping[str, Section], folder: Path, seconds: float) -> None:
    """Writes `report.html`, `results.json` and `figures/*.png|csv` into an empty folder."""
    (folder / FIGURES).mkdir()
    shown = []
    for key, section in sections.items():
        pictures = []
        for picture in section.pictures:
            image = png(picture.figure)
            (folder / FIGURES / f"{picture.name}.png").write_bytes(image)
            header, rows = picture.table()
            with (folder / FIGURES / f"{picture.name}.csv").open("w", newline="", encoding="utf-8") as file:
                csv.writer(file).writerows([header, *rows])
            pictures.append(
                {
                    "caption": picture.caption,
                    "name": picture.name,
                    "source": data_url(image),
                }
            )
        shown.append({"key": key, "section": section, "pictures": pictures, "numbers": section.numbers})
    numbers = results(sections)
    (folder / RESULTS).write_text(
        json.dumps(numbers, indent=2, allow_nan=False, ensure_ascii=False) + "\n", encoding="utf-8"
    )
    filled = page(
        "studies.reproduce",
        {"value": value},
        shown=shown,
        paper=[n for section in sections.values() for n in section.numbers if n.paper is not None],
        version=pdhocbf_drake.__version__,
        minutes=seconds / 60,
    )
    (folder / REPORT).write_text(filled, encoding="utf-8")


def value(number: float | None) -> str:
    """A number for the eye: four significant digits, a dash for none."""
    return "–" if number is None else f"{number:.4g}"


def _row(number: Number) -> dict[str, Any]:
    row = number._asdict()
    return {
        key: float(entry) if key in ("paper", "ours", "tolerance") and entry is not None else entry
        for key, entry in row.items()
    }
