"""What robustness costs and buys: a walk under disturbances without a barrier, with DCBF, P-DHOCBF and a robust one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from pdhocbf_drake.barriers import AffineBarrier
from pdhocbf_drake.config import parse_config
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.config import RobustConfig
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.loop import walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.robust import nearer_bound
from pdhocbf_drake.sets.disturbance import checked_half_widths
from pdhocbf_drake.simulation.build import Walk, build_walk
from pdhocbf_drake.simulation.checks import check_straight
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.certify.scenario_certificate import certify_scenario
from pdhocbf_drake.studies.certify.terminal import terminal_sets
from pdhocbf_drake.walking.walk_barrier import WalkBarrier

CERTIFIED = "P-DHOCBF in its set"
CONTROLLERS = ("none", "DCBF", "P-DHOCBF", "robust P-DHOCBF", CERTIFIED)
"""The last has the terminal set that is certified for the multiple, if there is one."""
RANDOM_WALKS = 4
_FALLEN = 1.0  # of the CoM from the stance foot [m]


class Outcome(NamedTuple):
    """One controller under one multiple of W.

    Attributes:
        controller: of `CONTROLLERS`.
        multiple: of the given disturbance.
        nearer: by how much the enforced bound is nearer, at most [unit of h].
        speed: mean speed along x of the walk without a disturbance [m/s].
        h_random, h_corners: least h under corners at random, and under each corner for ever; of walks that went on
            [unit of h].
        below: largest share of ticks with h < 0 of one walk.
        fell: how many of the walks fell, of how many.
    """

    controller: str
    multiple: float
    nearer: float
    speed: float
    h_random: float
    h_corners: float
    below: float
    fell: tuple[int, int]


def robust_study(
    scenario: Scenario,
    disturbance: tuple[float, float],
    multiples: Sequence[float] = (0.0, 0.5, 1.0, 2.0),
    report: Callable[[int, str], None] = lambda done, stage: None,
) -> list[Outcome]:
    """Walks the template of a scenario under every controller and multiple of a disturbance.

    h is that of the scenario's own barrier, also where the controller has none or another one.

    Args:
        scenario: a straight walk with one barrier, whose bound follows the orbit.
        disturbance: Δc, Δv [m, m/s].
        multiples: of it.
        report: called with the number of cases that are done and the name of the next one.

    Raises:
        InputError: the scenario is no such walk, or can't be built; or a disturbance that is none.
    """
    checked_half_widths(disturbance, 2, "of the CoM [m] and of its velocity [m/s]")
    if scenario.system == "van_der_pol" or len(scenario.barriers) != 1:
        raise InputError(
            f"scenario '{scenario.name}': a walk with one barrier is needed, given {len(scenario.barriers)}"
        )
    check_straight(scenario)
    _check_multiples(multiples, disturbance)
    judge = next(b for axis in build_walk(scenario).mpc.barriers for b in axis)
    outcomes = []
    for number, (multiple, controller) in enumerate(product(multiples, CONTROLLERS)):
        report(number, f"{controller}, {multiple:g} times")
        sides = np.array(disturbance) * multiple
        walk = build_walk(_with(scenario, controller, (float(sides[0]), float(sides[1]))))
        if controller == CERTIFIED:
            limited = _in_its_set(scenario, walk, (float(sides[0]), float(sides[1])))
            if limited is None:
                continue
            walk = limited
        outcomes.append(_outcome(walk, judge, controller, multiple, sides, scenario))
    return outcomes


def _check_multiples(multiples: Sequence[float], disturbance: tuple[float, float]) -> None:
    """Raises `InputError` for a multiple that is none, or too large for `mpc.robust`."""
    if not multiples or not all(0.0 <= multiple < np.inf for multiple in multiples):
        given = " ".join(f"{multiple:g}" for multiple in multiples)
        raise InputError(f"multiples: finite numbers from 0 on are needed (given: {given or 'none'})")
    for multiple in multiples:
        sides = [multiple * side for side in disturbance]
        parse_config(RobustConfig, {"disturbance": sides}, f"{multiple:g} times the disturbance")


def _with(scenario: Scenario, controller: str, sides: tuple[float, float]) -> Scenario:
    (name, barrier), mpc = next(iter(scenario.barriers.items())), scenario.mpc
    if controller == "none":
        return scenario.model_copy(update={"barriers": {}})
    if controller == "DCBF":
        if barrier.bound.kind != "orbit":
            raise InputError(
                f"barrier {name}: a constant bound is compared with one of kind orbit, given {barrier.bound.kind}"
            )
        peak = barrier.bound.model_copy(update={"kind": "orbit_peak"})
        return scenario.model_copy(update={"barriers": {name: barrier.model_copy(update={"bound": peak})}})
    if controller in ("P-DHOCBF", CERTIFIED):
        return scenario
    robust = RobustConfig(disturbance=sides)
    return scenario.model_copy(update={"mpc": mpc.model_copy(update={"robust": robust})})


def _in_its_set(scenario: Scenario, walk: Walk, sides: tuple[float, float]) -> Walk | None:
    """The walk with the terminal set for a disturbance; None where there is none."""
    found = certify_scenario(scenario, with_rows=scenario.mpc.barrier == "hard", disturbance=sides, search=False)
    try:
        sets = terminal_sets(found)
    except InputError:
        return None
    return replace(walk, mpc=PeriodicMpc(walk.gait, walk.vhip, scenario.mpc, walk.mpc.barriers, sets))


def _outcome(
    walk: Walk, judge: AffineBarrier, controller: str, multiple: float, sides: np.ndarray, scenario: Scenario
) -> Outcome:
    first = round(scenario.from_time / scenario.gait.tick)
    ticks = first + 10 * scenario.gait.ticks_per_gait
    calm = list(_walked(walk, judge, lambda tick: np.zeros((2, 2)), ticks, first))
    random = np.random.default_rng(scenario.seed)
    signs = random.choice([-1.0, 1.0], size=(RANDOM_WALKS, ticks + 1, 2, 2))
    corners = [np.array(corner) for corner in product((-1.0, 1.0), repeat=2)]
    tried = [lambda tick, own=own: sides * own[tick] for own in signs] if multiple else []
    tried += [lambda tick, corner=corner: np.tile(sides * corner, (2, 1)) for corner in corners] if multiple else []
    walks = [list(_walked(walk, judge, moved, ticks, first)) for moved in tried] or [calm]
    full = len(calm)
    least = [min((h for h, _ in seen), default=np.nan) if len(seen) == full else np.nan for seen in walks]
    at_random, at_corners = least[:RANDOM_WALKS], least[RANDOM_WALKS:] or least
    nearer = [nearer_bound(b, walk.vhip, walk.mpc.config, axis) for axis in (0, 1) for b in walk.mpc.barriers[axis]]
    most = max((float(part.max()) for part in nearer if part is not None), default=0.0)
    below = max(float(np.mean([h < 0.0 for h, _ in seen])) for seen in walks if seen)
    fell = sum(len(seen) < full for seen in walks), len(walks)
    speed = float(np.mean([v for _, v in calm]))
    h_random, h_corners = (float(np.nanmin([*part, np.inf])) for part in (at_random, at_corners))
    return Outcome(controller, multiple, most, speed, h_random, h_corners, below, fell)


def _walked(
    walk: Walk, judge: AffineBarrier, moved: Callable[[int], np.ndarray], ticks: int, first: int
) -> Iterator[tuple[float, float]]:
    """h and the speed along x at each tick from the first one on, until the walk falls."""
    memory = Memory.at_start(walk.mpc, walk.at_rest, walk.gait.feet_at_start)
    axis = judge.quantity.axis if isinstance(judge, WalkBarrier) else 0
    rows = walk_template(walk.mpc, memory, 0, ticks, disturbance=lambda k, state, memory, plan: moved(k))
    for row in rows:
        stance = row.before.stance[:, 1]
        if not np.all(np.abs(row.state[:, 0] - stance) < _FALLEN):
            return
        if row.tick >= first:
            seen = judge.seen(row.state[axis], stance[axis]) if isinstance(judge, WalkBarrier) else row.state[axis]
            yield float(judge.h(row.tick, seen)), float(row.state[0, 1])


def outcome_data(outcomes: Sequence[Outcome]) -> list[dict[str, Any]]:
    """The outcomes for robust.json; null where no walk went on."""
    return [{key: None if value == np.inf else value for key, value in one._asdict().items()} for one in outcomes]
