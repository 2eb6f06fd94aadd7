"""The parts of `pdhocbf reproduce`, and the sections that they make."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from pdhocbf_drake.files.pages import page
from pdhocbf_drake.studies.reproduce.joints import figure_6
from pdhocbf_drake.studies.reproduce.lemma_2 import lemma_2
from pdhocbf_drake.studies.reproduce.literal import MEASURED_ZMP, NO_DOUBLE_SUPPORT, literal_against_corrected
from pdhocbf_drake.studies.reproduce.oscillator import figure_1
from pdhocbf_drake.studies.reproduce.report import Section
from pdhocbf_drake.studies.reproduce.runs import Request, Runs
from pdhocbf_drake.studies.reproduce.schematics import figures_2_and_3
from pdhocbf_drake.studies.reproduce.sensitivity import sensitivity
from pdhocbf_drake.studies.reproduce.snapshots import figure_5
from pdhocbf_drake.studies.reproduce.theorem import theorem_1
from pdhocbf_drake.studies.reproduce.unsafe import figure_7
from pdhocbf_drake.studies.reproduce.unsafe_robot import EVENTS, figure_7_robot
from pdhocbf_drake.studies.reproduce.walk import ROBOT, figure_4, margins
from pdhocbf_drake.terminal import Progress

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
