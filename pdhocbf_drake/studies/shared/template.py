"""Events on the template: kicks and wrong speed commands that begin in the steady state of a walk."""

from __future__ import annotations

from copy import copy

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.loop import Measurement, walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.simulation.build import Walk, build_walk
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.shared.cases import CASES, NONE, in_case
from pdhocbf_drake.studies.shared.measures import Array, Outcome, Record, SafeOrbit, WithoutBarriers, values

SETTLING_GAITS = 15  # a walk from a stand then repeats to a thousandth of a margin


class SettledWalk:
    """The template of one case in steady state, from which events begin at any phase of the gait.

    Attributes:
        walk: gait, template, barriers and controller.
        first: the tick of phase 0.
        starts: the controller's memory before each tick of a gait, by phase.
        undisturbed: one gait without an event.

    Raises:
        InputError: the walk has an end.
    """

    def __init__(self, walk: Walk, free: PeriodicMpc | None = None) -> None:
        """`free` is the same problem without barriers, for the action of the barriers; None if the walk has none."""
        if walk.gait.config.walk_steps is not None:
            raise InputError("gait.walk_steps: events are tried on a walk without an end (null)")
        self.walk = walk
        self._mpc = walk.mpc
        self._free = free
        ticks = walk.gait.config.ticks_per_gait
        self.first = SETTLING_GAITS * ticks
        self.starts = [settled(walk.mpc, self.first)]
        self.starts += [row.memory for row in walk_template(walk.mpc, self.starts[0], self.first, ticks - 1)]
        self.undisturbed = self.after(0, np.zeros((0, 2)), ticks)

    def commanded(self, stride: float, step: int) -> SettledWalk:
        """The same walk and bounds under a wrong speed command: steps of length `stride` [m] from step `step` on."""
        other = copy(self)
        other._mpc = _with_stride(self._mpc, stride, step)
        other._free = None if self._free is None else _with_stride(self._free, stride, step)
        return other

    def after(self, phase: int, kicks: Array, ticks: int) -> Record:
        """The walk from a phase of the gait on.

        Args:
            phase: tick of the gait.
            kicks: velocity that a disturbance adds before each tick, in x and y, shape (≤ ticks, 2) [m/s].
            ticks: length of the walk.
        """
        first = self.first + phase
        free = None if self._free is None else WithoutBarriers(self._free)
        states, stances = np.empty((ticks, 2, 3)), np.empty((ticks, 2))
        action, planned = np.zeros(ticks), np.empty(ticks, dtype=bool)
        for i, row in enumerate(walk_template(self._mpc, self.starts[phase], first, ticks, kicks)):
            states[i], stances[i], planned[i] = row.state, row.before.stance[:, 1], not row.plan.fallbacks
            if free is not None:
                action[i] = free.action(row.before, Measurement(row.tick, row.state), row.plan)
        return Record(first, states, stances, values(self.walk, first, states, stances), action, planned)


class Laboratory:
    """The three cases of a scenario in steady state, from which the same event begins in each.

    Attributes:
        walks: by case.
        orbit: the reference for the walks after an event.
    """

    def __init__(self, scenario: Scenario) -> None:
        walks = {case: build_walk(in_case(scenario, case)) for case in CASES}
        free = walks[NONE].mpc
        self.walks = {case: SettledWalk(walk, None if case == NONE else free) for case, walk in walks.items()}
        self.orbit = SafeOrbit(scenario, self.walks[NONE].undisturbed)

    def kicked(self, case: str, phase: int, kicks: Array, ticks: int) -> Outcome:
        """The effect of kicks from a phase of the gait on; arguments as of `SettledWalk.after`."""
        walk = self.walks[case]
        return self.orbit.outcome(walk.after(phase, kicks, ticks), walk.undisturbed)

    def commanded(self, case: str, stride: float, ahead: int, ticks: int) -> Outcome:
        """The effect of a wrong speed command from phase 0 on: another stride [m] after `ahead` more steps."""
        walk = self.walks[case]
        step = walk.first // walk.walk.gait.period + ahead
        return self.orbit.outcome(walk.commanded(stride, step).after(0, np.zeros((0, 2)), ticks), walk.undisturbed)


def settled(mpc: PeriodicMpc, ticks: int) -> Memory:
    """The controller's memory after some ticks of the template's walk from a stand."""
    memory = Memory.standing(mpc)
    for row in walk_template(mpc, memory, 0, ticks):
        memory = row.memory
    return memory


def _with_stride(mpc: PeriodicMpc, stride: float, step: int) -> PeriodicMpc:
    return PeriodicMpc(mpc.gait.with_stride(stride, step), mpc.vhip, mpc.config, mpc.barriers, mpc.terminal)
