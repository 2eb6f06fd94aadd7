"""`pdhocbf reproduce`: every figure and number of the paper beside ours, in one folder."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from pdhocbf_drake.analysis.drawing import styled
from pdhocbf_drake.simulation.run_folder import new_run_folder
from pdhocbf_drake.studies.reproduce.report import FIGURES, REPORT, RESULTS, write_report
from pdhocbf_drake.studies.reproduce.runs import Runs
from pdhocbf_drake.studies.reproduce.sections import chosen, make_sections


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's arguments."""
    parser.add_argument("--out", type=Path, metavar="DIR", help="the folder; otherwise ./runs/reproduction")
    parser.add_argument("--only", metavar="PARTS", help="some parts only, such as fig1,fig4,margins")


def run(options: argparse.Namespace) -> int:
    """Makes the sections and writes them; gives the exit code."""
    keys = chosen(options.only)
    place: Path = options.out or Path("runs/reproduction")
    started = time.monotonic()

    def tell(line: str) -> None:
        print(f"[{time.monotonic() - started:5.0f} s] {line}", file=sys.stderr, flush=True)

    with new_run_folder(place, {REPORT, RESULTS, FIGURES}) as folder:
        with Runs(tell) as runs, styled():
            sections = make_sections(keys, runs)
        write_report(sections, folder, time.monotonic() - started)
    for number in (n for section in sections.values() for n in section.numbers if n.paper is not None):
        verdict = {None: "", True: "agrees", False: "DIFFERS"}[number.agrees]
        mark = " (calibrated)" if number.calibrated else ""
        print(f"{number.name}: paper {number.paper:.4g}, ours {number.ours:.4g} {number.unit} {verdict}{mark}".rstrip())
    print(place / REPORT)
    return 0
