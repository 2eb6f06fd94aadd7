"""`pdhocbf reproduce`: every figure and number of the paper beside ours, in one folder."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Final

from pdhocbf_drake.errors import InputError, PdhocbfError
from pdhocbf_drake.files.folder import new_folder
from pdhocbf_drake.stopping import stop_requests
from pdhocbf_drake.terminal import say, shown_progress

KEYS: Final = (
    "fig1", "fig2", "fig4", "margins", "sensitivity", "fig5", "fig6", "fig7", "fig7robot", "theorem", "lemma2",
    "literal",
)  # fmt: skip
"""Those of `parts.PARTS`, which loads Drake."""


def chosen(only: str | None) -> list[str]:
    """The keys of `--only` ("fig1,fig4"), in the report's order; all without it.

    Raises:
        InputError: a key that does not exist.
    """
    if only is None:
        return list(KEYS)
    asked = ["fig2" if key == "fig3" else key for key in map(str.strip, only.split(",")) if key]  # drawn together
    unknown = [key for key in asked if key not in KEYS]
    if unknown or not asked:
        wrong = unknown[0] if unknown else only
        raise InputError(f"--only: there is no part '{wrong}'; there are {', '.join(KEYS)} (fig3 comes with fig2)")
    return [key for key in KEYS if key in asked]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's arguments."""
    parser.add_argument("--out", type=Path, metavar="DIR", help="the folder; otherwise ./runs/reproduction")
    parser.add_argument("--only", metavar="PARTS", help="some parts only, such as fig1,fig4,margins")


def run(options: argparse.Namespace) -> int:
    """Makes the sections and writes them; returns the exit code."""
    keys = chosen(options.only)
    place: Path = options.out or Path("runs/reproduction")
    started = time.monotonic()
    # Here, since they load Drake: an argument that can't be used is refused at once.
    from pdhocbf_drake.analysis.drawing import styled
    from pdhocbf_drake.studies.reproduce.parts import make_sections
    from pdhocbf_drake.studies.reproduce.report import FIGURES, REPORT, RESULTS, write_report
    from pdhocbf_drake.studies.reproduce.runs import Runs

    with (
        new_folder(place, {REPORT, RESULTS, FIGURES}, "a folder of reproduce") as folder,
        shown_progress("reproduce", len(keys), "parts", every=True) as progress,
    ):
        with Runs() as runs, styled():
            sections = make_sections(keys, runs, progress)
        if not sections:
            raise PdhocbfError("no part could be made")
        with stop_requests():  # the parts that are made are written before such a request takes effect
            write_report(sections, folder.path, time.monotonic() - started)
            folder.finish()
    for number in (n for section in sections.values() for n in section.numbers if n.paper is not None):
        verdict = {None: "", True: "agrees", False: "DIFFERS"}[number.agrees]
        mark = " (calibrated)" if number.calibrated else ""
        print(f"{number.name}: paper {number.paper:.4g}, ours {number.ours:.4g} {number.unit} {verdict}{mark}".rstrip())
    print(place / REPORT)
    if missing := [key for key in keys if key not in sections]:
        say(f"pdhocbf: {len(sections)} of {len(keys)} parts are in {place}; what is missing is {', '.join(missing)}")
    return int(bool(missing))
