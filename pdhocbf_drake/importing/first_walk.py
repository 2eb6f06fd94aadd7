"""The walk that an import writes: the usual one, or one that asks less of a joint, and what is wrong with it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from pdhocbf_drake.errors import PdhocbfError
from pdhocbf_drake.fitting.findings import Finding
from pdhocbf_drake.importing.model_copy import Report
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.limits import findings_within_limits
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.walking.config import GaitConfig

_SLOWER = 1.25  # the duration of a step, over the usual one
_SHORTER = (1.0, 0.5)  # the stride, likewise


class FirstWalk(NamedTuple):
    """A walk.

    Attributes:
        gait: the keys of `gait` in which it differs from the usual walk.
        why: the fault of the usual walk, for which it differs; empty where it does not.
        faults: a sentence for each fault that it has itself.
    """

    gait: dict[str, Any]
    why: str
    faults: list[str]


def first_walk(scenario: Path, report: Report) -> FirstWalk:
    """The first of some walks in which `pdhocbf check` finds no fault; the usual one where it does in all.

    Args:
        scenario: the file of the usual walk. report: its progress.
    """
    report("checking its walk")
    try:
        usual = load_scenario(str(scenario)).gait
        found = _found(scenario, {})
    except PdhocbfError as error:
        return FirstWalk({}, "", [str(error)])
    faults = _faults(found)
    if not faults:
        return FirstWalk({}, "", [])
    report("searching a walk that asks less of it")
    for gait in _others(usual):
        try:
            other = _found(scenario, gait)
        except PdhocbfError:  # of a walk that is refused
            continue
        if not _faults(other) and (not _slow(other) or _slow(found)):
            return FirstWalk(gait, faults[0].said, [])
    return FirstWalk({}, "", [str(fault) for fault in faults])


def _found(scenario: Path, gait: dict[str, Any]) -> list[Finding]:
    walk = load_scenario(str(scenario), json.dumps({"gait": gait}))
    return findings_within_limits(walk, Biped.load(walk.robot))


def _faults(found: list[Finding]) -> list[Finding]:
    return [each for each in found if each.level == "fault"]


def _slow(found: list[Finding]) -> bool:
    """Whether a fall grows much in a step."""
    return any(each.check == "step time" and each.level != "ok" for each in found)


def _others(usual: GaitConfig) -> Iterator[dict[str, Any]]:
    """Walks that ask less of the joints: with a level CoM, slower steps, or both, and then with shorter steps."""
    level, slower = {"com_height_amplitude": 0.0}, {"ticks_per_step": round(_SLOWER * usual.ticks_per_step)}
    for share in _SHORTER:
        shorter = {} if share == 1.0 else {"stride": float(f"{share * usual.stride:.3g}")}
        for changed in ({}, level, slower, level | slower):
            if shorter | changed:
                yield shorter | changed
