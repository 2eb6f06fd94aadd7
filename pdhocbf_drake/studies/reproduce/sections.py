"""Every part of the reproduction, by the key that `--only` takes, in the order of the report."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.studies.reproduce.joints import figure_6
from pdhocbf_drake.studies.reproduce.lemma_2 import lemma_2
from pdhocbf_drake.studies.reproduce.literal import MEASURED_ZMP, NO_DOUBLE_SUPPORT, literal_against_corrected
from pdhocbf_drake.studies.reproduce.oscillator import figure_1
from pdhocbf_drake.studies.reproduce.record import Section
from pdhocbf_drake.studies.reproduce.runs import Request, Runs
from pdhocbf_drake.studies.reproduce.schematics import figures_2_and_3
from pdhocbf_drake.studies.reproduce.sensitivity import sensitivity
from pdhocbf_drake.studies.reproduce.snapshots import figure_5
from pdhocbf_drake.studies.reproduce.theorem import theorem_1
from pdhocbf_drake.studies.reproduce.unsafe import figure_7
from pdhocbf_drake.studies.reproduce.unsafe_robot import EVENTS, figure_7_robot
from pdhocbf_drake.studies.reproduce.walk import ROBOT, figure_4, margins

_ROBOT = tuple(ROBOT.values())
_UNSAFE = tuple(request for requests in EVENTS.values() for request in requests.values())


class Part(NamedTuple):
    """A section to make, and the runs of the robot that it needs, which a worker begins with."""

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

# Made in this order, so that the worker's runs of the robot are ready when they are wanted.
_LATE = ("fig4", "margins", "fig5", "fig6", "literal", "fig7robot")


def chosen(only: str | None) -> list[str]:
    """The keys of `--only` ("fig1,fig4"), in the report's order; all without it.

    Raises:
        InputError: a key that does not exist.
    """
    if only is None:
        return list(PARTS)
    asked = [key.strip() for key in only.split(",") if key.strip()]
    asked = ["fig2" if key == "fig3" else key for key in asked]  # one section draws both
    unknown = [key for key in asked if key not in PARTS]
    if unknown or not asked:
        what = unknown[0] if unknown else only
        raise InputError(f"--only: there is no part '{what}'; there are {', '.join(PARTS)} (fig3 comes with fig2)")
    return [key for key in PARTS if key in asked]


def make_sections(keys: list[str], runs: Runs) -> dict[str, Section]:
    """The sections with these keys, in that order."""
    needs = dict.fromkeys(request for key in (k for k in _LATE if k in keys) for request in PARTS[key].needs)
    runs.ahead(needs)
    made = {}
    for key in sorted(keys, key=lambda key: key in _LATE and 1 + _LATE.index(key)):
        runs.tell(f"making {key}")
        made[key] = PARTS[key].make(runs)
    return {key: made[key] for key in keys}
