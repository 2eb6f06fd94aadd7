"""`pdhocbf reproduce`: every figure and number of the paper beside ours, in one folder."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from pdhocbf_drake.analysis.drawing import styled
from pdhocbf_drake.errors import InputError, PdhocbfError
from pdhocbf_drake.files.folder import new_folder
from pdhocbf_drake.files.pages import page
from pdhocbf_drake.stopping import stop_requests
from pdhocbf_drake.studies.reproduce.joints import figure_6
from pdhocbf_drake.studies.reproduce.lemma_2 import lemma_2
from pdhocbf_drake.studies.reproduce.literal import MEASURED_ZMP, NO_DOUBLE_SUPPORT, literal_against_corrected
from pdhocbf_drake.studies.reproduce.oscillator import figure_1
from pdhocbf_drake.studies.reproduce.report import FIGURES, REPORT, RESULTS, Section, write_report
from pdhocbf_drake.studies.reproduce.runs import Request, Runs
from pdhocbf_drake.studies.reproduce.schematics import figures_2_and_3
from pdhocbf_drake.studies.reproduce.sensitivity import sensitivity
from pdhocbf_drake.studies.reproduce.snapshots import figure_5
from pdhocbf_drake.studies.reproduce.theorem import theorem_1
from pdhocbf_drake.studies.reproduce.unsafe import figure_7
from pdhocbf_drake.studies.reproduce.unsafe_robot import EVENTS, figure_7_robot
from pdhocbf_drake.studies.reproduce.walk import ROBOT, figure_4, margins
from pdhocbf_drake.terminal import Progress, say, shown_progress

_ROBOT = tuple(ROBOT.values())
_UNSAFE = tuple(request for requests in EVENTS.values() for request in requests.values())


class Part(NamedTuple):
    """The function that makes a section, and the runs of the robot that it needs, simulated ahead by a worker."""

    make: Callable[[Runs], Section]
    needs: tuple[Request, ...] = ()


PARTS: dict[str, Part] = {
    "fig1": Part(figure_1),
    "fig2": Part(figures_2_and_3),
    "fig4": Part(figure_4, _ROBOT),
    "margins": Part(margins, _ROBOT),
    "sensitivity": Part(sensitivity),
    "fig5": Part(figure_5, _ROBOT[1:]),
    "fig6": Part(figure_6, _ROBOT[1:]),
    "fig7": Part(figure_7),
    "fig7robot": Part(figure_7_robot, _UNSAFE),
    "theorem": Part(theorem_1),
    "lemma2": Part(lemma_2),
    "literal": Part(literal_against_corrected, (_ROBOT[1], NO_DOUBLE_SUPPORT, MEASURED_ZMP)),
}


def chosen(only: str | None) -> list[str]:
    """The keys of `--only` ("fig1,fig4"), in the report's order; all without it.

    Raises:
        InputError: a key that does not exist.
    """
    if only is None:
        return list(PARTS)
    asked = ["fig2" if key == "fig3" else key for key in map(str.strip, only.split(",")) if key]  # drawn together
    unknown = [key for key in asked if key not in PARTS]
    if unknown or not asked:
        wrong = unknown[0] if unknown else only
        raise InputError(f"--only: there is no part '{wrong}'; there are {', '.join(PARTS)} (fig3 comes with fig2)")
    return [key for key in PARTS if key in asked]


def make_sections(keys: Sequence[str], runs: Runs, report: Progress) -> dict[str, Section]:
    """The sections with these keys, in that order; those made so far after Ctrl-C, and all but one that fails.

    Args:
        keys: some of `PARTS`.
        runs: shared by the parts.
        report: called with the number of finished sections, and the name of the next step.
    """
    # Those that need most runs of the robot are made last, so that the worker has simulated them by then.
    order = sorted(keys, key=lambda key: len(PARTS[key].needs))
    runs.prepare(request for key in order for request in PARTS[key].needs)
    made: dict[str, Section] = {}
    runs.report = lambda words: report(len(made), words)
    for key in order:
        runs.report(f"making {key}")
        try:
            with page(key):
                section = PARTS[key].make(runs)
                own = f"pdhocbf reproduce --only {key}"
                section.numbers = [number._replace(command=number.command or own) for number in section.numbers]
                made[key] = section
        except KeyboardInterrupt as error:
            if not made:
                raise
            runs.end(error)
            break
    else:
        report(len(made))
    return {key: made[key] for key in keys if key in made}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's arguments."""
    parser.add_argument("--out", type=Path, metavar="DIR", help="the folder; otherwise ./runs/reproduction")
    parser.add_argument("--only", metavar="PARTS", help="some parts only, such as fig1,fig4,margins")


def run(options: argparse.Namespace) -> int:
    """Makes the sections and writes them; returns the exit code."""
    keys = chosen(options.only)
    place: Path = options.out or Path("runs/reproduction")
    started = time.monotonic()

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
