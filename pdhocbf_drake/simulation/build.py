"""The objects of a scenario's walk: gait, template, barriers, compiled MPC."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pdhocbf_drake.config import parse_config
from pdhocbf_drake.kept import Kept
from pdhocbf_drake.mpc.config import SENSING
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.orbit import nominal_walk, settled_gait
from pdhocbf_drake.mpc.programs import ProgramCache
from pdhocbf_drake.mpc.terminal_set import limits_of, load_terminal_sets
from pdhocbf_drake.mpc.terms.zmp_velocity import check_zmp_velocity
from pdhocbf_drake.simulation.barrier_changes import add_changes, changing, changing_problem
from pdhocbf_drake.simulation.command_orbits import ConstantWalks, constant_walk
from pdhocbf_drake.simulation.commands import commanded_gait
from pdhocbf_drake.simulation.kept_walk import keep_programs, kept_programs, walk_file
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_barriers import AT_REST, barrier_of, naming
from pdhocbf_drake.simulation.sensed import EXACT, sensed
from pdhocbf_drake.walking import Gait, GaitConfig
from pdhocbf_drake.walking.barrier_config import WalkBarrierConfig
from pdhocbf_drake.walking.commanded_walk import CommandedFootsteps
from pdhocbf_drake.walking.commands import Command
from pdhocbf_drake.walking.quantities import Quantity
from pdhocbf_drake.walking.vhip import Vhip
from pdhocbf_drake.walking.walk_barrier import CommandOrbits, WalkBarrier

_STANDING = 2  # steps that a walk under one command stands before it begins
_COMPLETE = "complete"  # a name among what is kept of a walk


@dataclass(frozen=True)
class Walk:
    """A walk before it starts.

    Attributes:
        gait: the footsteps. vhip: the template. mpc: problem (36), compiled.
        quantities, barriers: the barriers in the scenario's order, and the quantity that each one bounds.
    """

    gait: Gait
    vhip: Vhip
    mpc: PeriodicMpc
    quantities: tuple[Quantity, ...]
    barriers: tuple[WalkBarrier, ...]

    @property
    def at_rest(self) -> np.ndarray:
        """[c, v, p] per axis at tick 0: standing between the feet, shape (2, 3)."""
        state = AT_REST.copy()
        state[:, [0, 2]] = self.gait.foothold(-1)[:, None]
        return state

    @property
    def axes(self) -> tuple[int, ...]:
        """0 (x) or 1 (y) for each barrier."""
        return tuple(quantity.axis for quantity in self.quantities)

    @property
    def names(self) -> list[tuple[int, str]]:
        """(axis, name) of each barrier."""
        return [(axis, barrier.name) for axis, barrier in zip(self.axes, self.barriers, strict=True)]


class WalkParts:
    """What several walks have in common, by what it was made from: compiled programs, and nominal walks.

    Args:
        most: how many of each are kept, the last ones asked for; None keeps all.
    """

    def __init__(self, most: int | None = None, programs: ProgramCache | None = None) -> None:
        self.programs = ProgramCache(most=most) if programs is None else programs
        self._nominal = Kept[np.ndarray](most)

    def nominal_walk(self, scenario: Scenario, stride: float, rise: float = 0.0) -> np.ndarray:
        """As `nominal_walk_of`, in an array that is not to be written into."""
        gait = gait_of(scenario, stride)
        key = gait.config.model_dump_json(), scenario.mpc.model_dump_json(exclude={"recovery", *SENSING}), rise
        return self._nominal.get(key, lambda: nominal_walk_of(scenario, stride, self.programs, rise))


class _OfOneWalk(WalkParts):
    """The parts of a walk that has a file of its own on disk, with its nominal walks by their strides."""

    def nominal_walk(self, scenario: Scenario, stride: float, rise: float = 0.0) -> np.ndarray:
        name = f"orbit {stride!r}" + (f" {rise!r}" if rise else "")
        return self.programs.array(name, lambda: nominal_walk_of(scenario, stride, self.programs, rise))


def build_walk(scenario: Scenario, parts: WalkParts | None = None) -> Walk:
    """The walk of a scenario.

    Args:
        scenario: the scenario.
        parts: what other walks have in common with it; None for what is kept on disk of this one.

    Raises:
        InputError: a gait that can't be walked, a horizon against Lemma 2, a bound on the ZMP's velocity below that of
            the nominal walk, a barrier with the wrong relative degree, or one whose safe set excludes the start.
    """
    if parts is not None:
        return _built(scenario, parts)
    programs = kept_programs(scenario)
    walk = _built(scenario, _OfOneWalk(programs=programs))
    keep_programs(scenario, programs)
    return walk


def complete_programs(scenario: Scenario) -> None:
    """Compiles and keeps what a walk has not needed so far, but may need: the programs of a disturbed one."""
    programs = kept_programs(scenario)
    if scenario.mpc.recovery is not None and _COMPLETE not in programs and walk_file(scenario) is not None:
        _built(scenario, _OfOneWalk(programs=programs)).mpc.prepare()
        programs.array(_COMPLETE, lambda: np.zeros(0))
        keep_programs(scenario, programs)


def _built(scenario: Scenario, parts: WalkParts) -> Walk:
    gait, cache = commanded_gait(scenario), parts.programs
    vhip = Vhip(gait.eta(), gait.config.tick)
    walks = _constant_walks(scenario, gait, cache)

    def barrier(name: str, config: WalkBarrierConfig) -> WalkBarrier:
        nominal, orbits = list[tuple[float, np.ndarray]](), None
        if walks is not None:
            orbits = _command_orbits(config, walks)
        if config.bound.follows_orbit and (orbits is None or orbits.margin is None):
            stride = gait.config.stride if config.bound.stride is None else config.bound.stride
            with naming(name):
                gait_of(scenario, stride)
            nominal.append((0.0, parts.nominal_walk(scenario, stride)))
            climbs = even_climbs(gait) if config.bound.stride is None else []
            nominal += [(rise, parts.nominal_walk(scenario, length, rise)) for length, rise in climbs]
        return barrier_of(name, config, gait, vhip, nominal, orbits)

    barriers = [barrier(name, config) for name, config in scenario.barriers.items()]
    if scenario.mpc.zmp_velocity_max is not None:
        _check_zmp_velocity(scenario, cache)
    quantities = tuple(config.bounded for config in scenario.barriers.values())
    terminal = None
    if scenario.mpc.terminal_set is not None:
        limits = limits_of(scenario.gait, scenario.mpc, scenario.barriers)
        terminal = load_terminal_sets(Path(scenario.mpc.terminal_set), limits)

    def problem(own: Sequence[WalkBarrier]) -> PeriodicMpc:
        x, y = ([b for b in own if b.quantity.axis == axis] for axis in (0, 1))

        def on(rise: float) -> PeriodicMpc:
            template = vhip if not rise else Vhip(gait.eta(rise), gait.config.tick)
            return PeriodicMpc(gait, template, sensed(scenario), (x, y), terminal, cache)

        mpc = on(0.0)
        mpc.of_rises = {rise: on(rise) for rise in sorted(gait.rises)}
        return mpc

    if not scenario.barrier_changes:
        return Walk(gait, vhip, problem(barriers), quantities, tuple(barriers))
    settings = changing(scenario, barriers, barrier)
    mpc = changing_problem(problem, barriers, settings)
    add_changes(scenario, settings)
    return Walk(gait, vhip, mpc, quantities, tuple(barriers))


def even_climbs(gait: Gait) -> list[tuple[float, float]]:
    """Length and rise of the steps of each even staircase [m]."""
    if not gait.rises:
        return []
    steps = [(gait.step(j + 1).x - gait.step(j).x, gait.rise(j)) for j in range(len(gait.footsteps.listed))]
    return sorted({(round(length, 4), rise) for length, rise in steps if rise})


def _constant_walks(scenario: Scenario, gait: Gait, cache: ProgramCache) -> ConstantWalks | None:
    """The settled walks under each command of a scenario with barriers; None for a straight walk."""
    footsteps = gait.footsteps
    if not (scenario.barriers and (scenario.commands or scenario.path) and isinstance(footsteps, CommandedFootsteps)):
        return None
    assert footsteps.line is not None
    config, limits = gait.config.model_copy(update={"start_steps": _STANDING}), footsteps.line.limits
    walks = ConstantWalks(_undisturbed(scenario, constant_walk(config, Command(), limits), cache), limits)
    if any(barrier.bound.follows_orbit and barrier.bound.stride is None for barrier in scenario.barriers.values()):
        steps = range(math.ceil(scenario.duration / (gait.period * gait.config.tick)))
        walks(Command())  # by which a stand that is pushed keeps its balance
        for command in dict.fromkeys(map(footsteps.line.command, steps)):
            if command.walks:
                walks.prepare(command)
    return walks


def _command_orbits(config: WalkBarrierConfig, walks: ConstantWalks) -> CommandOrbits:
    bound = config.bound
    if not bound.follows_orbit or bound.stride is not None:
        return CommandOrbits(walks, expect=walks.expect)
    return CommandOrbits(walks, bound.margin or 0.0, bound.kind == "orbit_peak", walks.expect)


def gait_of(scenario: Scenario, stride: float) -> Gait:
    """The scenario's gait with another stride, a short stand before it and no end; raises `InputError`."""
    begin = scenario.gait.start_steps  # the orbit depends on whether even steps are left or right stances, and no more
    standing = min(begin, 2 - begin % 2)
    changes = {"stride": stride, "walk_steps": None, "start_steps": standing}
    return Gait(parse_config(GaitConfig, scenario.gait.model_dump() | changes, "gait"))


def nominal_walk_of(
    scenario: Scenario, stride: float, cache: ProgramCache | None = None, rise: float = 0.0
) -> np.ndarray:
    """[c, v, p] of the scenario's nominal walk at a stride, shape (2, 2N, 3); see `mpc.orbit.nominal_walk`.

    With a `rise` that of a walk that climbs by it at every step [m].
    """
    mpc = nominal_mpc(scenario, stride, cache, rise)
    return nominal_walk(mpc.gait, mpc)


def nominal_mpc(scenario: Scenario, stride: float, cache: ProgramCache | None, rise: float = 0.0) -> PeriodicMpc:
    """The scenario's MPC for a walk that nothing disturbs, without barriers and without an end."""
    return _undisturbed(scenario, gait_of(scenario, stride), cache, rise)


def _undisturbed(scenario: Scenario, gait: Gait, cache: ProgramCache | None, rise: float = 0.0) -> PeriodicMpc:
    vhip = Vhip(gait.eta(rise), gait.config.tick)
    config = scenario.mpc.model_copy(update={"recovery": None, **EXACT})
    return PeriodicMpc(gait, vhip, config, ([], []), None, cache)


def _check_zmp_velocity(scenario: Scenario, cache: ProgramCache) -> None:
    """Refuses a bound on the ZMP's velocity that the walk without it, once settled, would not keep; `InputError`."""
    unlimited = scenario.model_copy(update={"mpc": scenario.mpc.model_copy(update={"zmp_velocity_max": None})})
    mpc = nominal_mpc(unlimited, scenario.gait.stride, cache)
    boxes = np.array([tick.memory.zmp_box.reshape(2, 2) for tick in settled_gait(mpc.gait, mpc)])
    check_zmp_velocity(scenario.mpc, boxes, scenario.gait.tick)
