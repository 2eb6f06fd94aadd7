"""Time of a step and CoM height of a walk over uneven ground, where a scenario gives none."""

from __future__ import annotations

from collections.abc import Set
from typing import NamedTuple

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.fitting.uneven_walk import HURRIED, LEAST_CLEARANCE, uneven_steps
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.commands import commanded_gait
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.walking import Gait

_LONGER = 1.0, 1.25, 1.5, 2.0, 2.5  # times of a step, over the usual one
_LOWER = 1.0, 0.98, 0.96, 0.94, 0.92, 0.9, 0.88, 0.86, 0.84  # CoM heights, likewise


class Chosen(NamedTuple):
    """A scenario with what its ground asks for, and what that is in words, empty where nothing was changed."""

    scenario: Scenario
    said: str = ""


def chosen_for_ground(scenario: Scenario, free: Set[str]) -> Chosen:
    """The scenario with the shortest steps in which the feet pass all edges unhurriedly, and then the highest CoM from
    which the legs reach every step; as it is where that can't be chosen or the map is level.
    """
    if scenario.system != "biped" or not any(piece.known for piece in scenario.ground):
        return Chosen(scenario)
    found, said = scenario, list[str]()
    try:
        if {"gait.ticks_per_step", "mpc.horizon"} <= free:
            timed = (_with_time(scenario, factor) for factor in _LONGER)
            found = next(filter(_is_unhurried, timed), scenario)
            if found.gait != scenario.gait:
                said.append(f"steps of {found.gait.ticks_per_step * found.gait.tick:g} s")
        if "gait.com_height" in free:
            height = _highest(Biped.load(scenario.robot), commanded_gait(found))
            if height != found.gait.com_height:
                found = _with_gait(found, com_height=height)
                said.append(f"a CoM height of {height:g} m")
    except InputError:  # a walk that is not possible, as is said where it is built
        return Chosen(scenario)
    return Chosen(found, " and ".join(said))


def _is_unhurried(scenario: Scenario) -> bool:
    steps = uneven_steps(None, commanded_gait(scenario))
    return all(step.acceleration <= HURRIED and step.clearance >= LEAST_CLEARANCE for step in steps)


def _with_time(scenario: Scenario, factor: float) -> Scenario:
    usual = scenario.gait.ticks_per_step
    ticks = round(usual * factor)
    horizon = max(scenario.mpc.horizon // (2 * usual), 1) * 2 * ticks
    mpc = scenario.mpc.model_copy(update={"horizon": horizon})
    return _with_gait(scenario.model_copy(update={"mpc": mpc}), ticks_per_step=ticks)


def _with_gait(scenario: Scenario, **values: float) -> Scenario:
    return scenario.model_copy(update={"gait": scenario.gait.model_copy(update=values)})


def _highest(biped: Biped, gait: Gait) -> float:
    """The highest CoM height, up to the gait's, from which the legs reach every step; the gait's where none does."""
    for factor in _LOWER:
        height = round(gait.config.com_height * factor, 3)
        lower = Gait(gait.config.model_copy(update={"com_height": height}), gait.footsteps)
        if not any(step.missed for step in uneven_steps(biped, lower)):
            return height
    return gait.config.com_height
