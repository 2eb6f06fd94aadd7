"""The search for a gait as a function: quick measures of many gaits, and a simulation of the best ones."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.robot import ROLES, Biped
from pdhocbf_drake.simulation.checks import check_straight
from pdhocbf_drake.simulation.run_log import FINISHED
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.shared.gait_measures import GaitMeasures, measure
from pdhocbf_drake.studies.shared.gait_variants import KEYS, Work, varied
from pdhocbf_drake.studies.shared.pool import in_processes
from pdhocbf_drake.studies.tune.aims import AIMS, BEYOND, cost
from pdhocbf_drake.studies.tune.chosen import chosen
from pdhocbf_drake.studies.tune.joint_limits import JointLimits
from pdhocbf_drake.studies.tune.quick import quick_measure
from pdhocbf_drake.studies.tune.search import STRIDE, Space, Values, search

_DIRECTIONS = ("+x", "-x", "+y", "-y")  # of the pushes that confirm a gait
_PHASES = (0.1, 0.6)  # of a step, at which they begin


class Tuned(NamedTuple):
    """What a search has found.

    Attributes:
        scenario: with the best gait; the given one where none is better.
        gaits: the scenario's own gait, then those that were simulated, the best one by quick measures first.
        best: of these.
        tried: how many gaits were measured without a simulation.
        asked: the joint that is asked too much even in the best gait, and how much, in words; empty if none is.
    """

    scenario: Scenario
    gaits: list[GaitMeasures]
    best: GaitMeasures
    tried: int
    asked: str = ""


def tune(
    scenario: Scenario,
    *,
    aim: str = "torque",
    joint: str | None = None,
    keys: Sequence[str] | None = None,
    confirmed: int = 2,
    workers: int = 1,
    progress: Callable[[int], None] | None = None,
) -> Tuned:
    """Searches phase, height and amplitude of the CoM, double support and step time; for speed the stride, too.

    Args:
        scenario: a robot's walk straight ahead without an end.
        aim: of `aims.AIMS`.
        joint: for the aim "torque" the role of `robot.ROLES` whose torque counts; None for the shares of all limits.
        keys: of `gait`, what is searched in place of all of these.
        confirmed: how many of the best gaits are simulated, beside the scenario's own, see `chosen`.
        workers: processes; with more than one, the calling script needs `if __name__ == "__main__":`.
        progress: called with the number of gaits measured so far.

    Raises:
        InputError: no such walk, aim or joint; or no gait could be measured.
        PdhocbfError: a worker process died.
    """
    searched = _searched(aim, keys)
    _check(scenario, aim, joint, confirmed)
    limits = JointLimits.of(Biped.load(scenario.robot))
    speed = scenario.gait.stride / (scenario.gait.ticks_per_step * scenario.gait.tick)
    directions = _DIRECTIONS if aim == "push" else ()
    done = 0

    def measured(measuring: Callable[[Work], GaitMeasures], all_values: list[Values]) -> list[GaitMeasures]:
        nonlocal done
        work, broken = [], []
        for values in all_values:
            try:
                changed = varied(scenario, values)
                phases = tuple(round(share * changed.gait.ticks_per_step) for share in _PHASES)
                work.append(Work(values, changed.model_dump_json(), directions, phases))
            except InputError as error:
                broken.append(GaitMeasures(values, str(error)))
        found = {str(gait.values): gait for gait in broken}
        for gait in in_processes(measuring, work, workers):
            found[str(gait.values)] = gait
            done += 1
            if progress is not None:
                progress(done)
        return [found[str(values)] for values in all_values]

    least_inside, seen = 0.0, dict[str, GaitMeasures]()

    def cost_of(gait: GaitMeasures) -> float:
        return cost(gait, aim, joint, limits, least_inside, speed)

    def costs(all_values: list[Values]) -> list[float]:
        found = measured(quick_measure, all_values)
        seen.update((str(gait.values), gait) for gait in found)
        return [cost_of(gait) for gait in found]

    space = Space(scenario, searched)
    tried = search(space, costs)
    own = space.values(space.start)
    # Gaits of the same cost are the same: without an amplitude, its phase does not matter.
    others = {value: seen[str(values)] for value, values in reversed(tried) if values != own}
    gaits = measured(measure, [own, *(gait.values for gait in chosen(others, seen[str(own)], confirmed))])
    if gaits[0].ending == FINISHED:
        least_inside = min(0.0, gaits[0].zmp_inside or 0.0)
    best = min(gaits, key=cost_of)
    if math.isinf(cost_of(best)):
        raise InputError(f"no gait was found that walks as it should; the scenario's own: {_why(gaits)}")
    asked = limits.asked_most(best) if cost_of(best) >= BEYOND else ""
    return Tuned(varied(scenario, {} if best.values == own else best.values), gaits, best, len(tried), asked)


def _searched(aim: str, keys: Sequence[str] | None) -> Sequence[str]:
    allowed = (*KEYS, STRIDE) if aim == "speed" else KEYS
    for key in keys or ():
        if key not in allowed:
            raise InputError(f"keys: for the aim {aim} these are searched: {', '.join(allowed)} (given: {key})")
    return allowed if keys is None else [key for key in allowed if key in keys]


def _why(gaits: list[GaitMeasures]) -> str:
    ending = gaits[0].ending
    return "its ZMP leaves the box, it is too slow, or it misses a barrier" if ending == FINISHED else ending


def _check(scenario: Scenario, aim: str, joint: str | None, confirmed: int) -> None:
    if scenario.system != "biped" or scenario.gait.walk_steps is not None:
        raise InputError(
            f"scenario '{scenario.name}': a robot's walk without an end is needed (system: biped, "
            "gait.walk_steps: null)"
        )
    check_straight(scenario)
    if aim not in AIMS:
        raise InputError(f"aim: must be one of {', '.join(AIMS)} (given: {aim})")
    if joint is not None and joint not in ROLES:
        raise InputError(f"joint: must be one of {', '.join(ROLES)} (given: {joint})")
    if joint is not None and aim != "torque":
        raise InputError(f"joint: belongs to the aim torque (given: {joint} with the aim {aim})")
    if aim == "speed" and scenario.gait.stride == 0.0:
        raise InputError("gait.stride: must not be 0 where the speed is to be increased")
    if confirmed < 1:
        raise InputError(f"confirmed: must be 1 or more (given: {confirmed})")


def changes(before: Scenario, after: Scenario) -> dict[str, Any]:
    """The keys of `gait` and `mpc` in which two scenarios differ, as they stand in a file."""
    old, new = before.to_dict(), after.to_dict()
    found: dict[str, Any] = {}
    for part in ("gait", "mpc"):
        changed = {key: value for key, value in new[part].items() if value != old[part][key]}
        found |= {part: changed} if changed else {}
    return found
