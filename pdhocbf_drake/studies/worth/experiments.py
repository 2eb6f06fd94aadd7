"""The experiments of `pdhocbf worth`: a kick, a push and a wrong speed command, in all three cases and for some γ."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache

import numpy as np

from pdhocbf_drake.errors import reason
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.shared.cases import DCBF, NONE, PERIODIC, in_case
from pdhocbf_drake.studies.shared.measures import Array, Outcome, Record, SafeOrbit
from pdhocbf_drake.studies.shared.pool import in_processes
from pdhocbf_drake.studies.shared.pushing import PushedWalk, Trial
from pdhocbf_drake.studies.shared.template import SettledWalk
from pdhocbf_drake.studies.worth.results import Measures

_TEMPLATE_TICKS = 160  # from an event on, and twice as many under a wrong command
_ROBOT_SECONDS = 2.4


class Worth(ABC):
    """Events that act forward on the walk of one scenario.

    Args:
        scenario: the walk, whose barriers give the bounded quantities and their margins.
        kick: size of a kick. push: size of a push that lasts a step.
        command: commanded stride over the one that the bounds were made for [1].
        phases: ticks of the gait at which kicks and pushes begin.

    Attributes:
        stopped: why `run` ended before its last case; empty if it did not.
    """

    plant: str
    stopped = ""

    def __init__(self, scenario: Scenario, kick: float, push: float, command: float, phases: Sequence[int]) -> None:
        gait = scenario.gait
        self._made_from = type(self), scenario.model_dump_json(), kick, push, command, tuple(phases)
        self._scenario, self._phases = scenario, tuple(phases)
        self._stride = gait.stride * command
        self._command = f"command {self._stride:g} m for {gait.stride:g} m"
        self._tick, self._ticks_per_step = gait.tick, gait.ticks_per_step

    def run(
        self, gammas: Sequence[float], report: Callable[[int, str], None] = lambda done, case: None, workers: int = 1
    ) -> list[Measures]:
        """Every event without a barrier, then under both kinds of barrier for each γ.

        An error or Ctrl-C after the first case ends it, and is the attribute `stopped`.

        Args:
            gammas: class-K rates.
            report: called with the number of cases that are done, of 1 + 2 len(gammas), and the name of the next one;
                with several processes that of the last one.
            workers: processes.
        """
        cases = [(NONE, math.nan), *((case, gamma) for case in (DCBF, PERIODIC) for gamma in gammas)]
        kept: dict[int, list[Measures]] = {}
        try:
            for place, rows in self._rows(cases, report, workers):
                kept[place] = rows
                if workers > 1:
                    report(len(kept), _name(*cases[place]))
        except (KeyboardInterrupt, Exception) as error:
            if not kept:
                raise
            self.stopped = f"{reason(error)}; {len(kept)} of {len(cases)} cases are kept"
        return [row for place in sorted(kept) for row in kept[place]]

    def _rows(
        self, cases: Sequence[tuple[str, float]], report: Callable[[int, str], None], workers: int
    ) -> Iterator[tuple[int, list[Measures]]]:
        """The rows of each case, and its place among the cases."""
        if workers > 1:
            yield from in_processes(
                _case, [(*self._made_from, place, *case) for place, case in enumerate(cases)], workers
            )
            return
        for place, case in enumerate(cases):
            report(place, _name(*case))
            yield place, self.case(*case)

    def case(self, case: str, gamma: float) -> list[Measures]:
        """The rows of one case; γ plays no part without barriers."""
        return self._events(case, gamma, in_case(self._scenario, case, None if case == NONE else gamma))

    @abstractmethod
    def _events(self, case: str, gamma: float, scenario: Scenario) -> list[Measures]:
        """The events in one case, which `scenario` is in."""

    def _row(
        self, case: str, gamma: float, event: str, phase: int, outcome: Outcome, work: float, survived: bool
    ) -> Measures:
        recovers = outcome.recovers if survived else math.nan
        return Measures(
            self.plant, case, gamma, event, phase, outcome.notices * self._tick, outcome.acts * self._tick,
            outcome.excess, recovers * self._tick,
            math.nan if math.isnan(recovers) else math.ceil(recovers / self._ticks_per_step), work, survived,
        )  # fmt: skip


def _name(case: str, gamma: float) -> str:
    return case if case == NONE else f"{case}, gamma {gamma:g}"


Case = tuple[type[Worth], str, float, float, float, tuple[int, ...], int, str, float]
"""What an experiment is made from, and the place, name and γ of one of its cases."""


def _case(work: Case) -> tuple[int, list[Measures]]:
    *made_from, place, case, gamma = work
    return place, _experiment(*made_from).case(case, gamma)


@lru_cache(maxsize=1)  # a process has the same experiment for its next case
def _experiment(
    kind: type[Worth], scenario: str, kick: float, push: float, command: float, phases: tuple[int, ...]
) -> Worth:
    return kind(Scenario.model_validate_json(scenario), kick, push, command, phases)


class TemplateWorth(Worth):
    """On the template: the kick is a velocity gained at once [m/s], the push an acceleration [m/s²].

    Attributes:
        events: velocity gained before each tick, in x and y, shape (T, 2) [m/s], by the name of the kick or push.
    """

    plant = "template"

    def __init__(self, scenario: Scenario, kick: float, push: float, command: float, phases: Sequence[int]) -> None:
        super().__init__(scenario, kick, push, command, phases)
        n = self._ticks_per_step
        self.events: dict[str, Array] = {
            f"kick {1e3 * kick:g} mm/s": np.array([[kick, 0.0]]),
            f"push {push:g} m/s², {n * self._tick:g} s": np.tile([push * self._tick, 0.0], (n, 1)),
        }
        self._free = SettledWalk(build_walk(in_case(scenario, NONE)))
        self._orbit = SafeOrbit(scenario, self._free.undisturbed)

    def _events(self, case: str, gamma: float, scenario: Scenario) -> list[Measures]:
        walk = self._free if case == NONE else SettledWalk(build_walk(scenario), self._free.walk.mpc)

        def row(event: str, phase: int, record: Record) -> Measures:
            outcome = self._orbit.outcome(record, walk.undisturbed)
            return self._row(case, gamma, event, phase, outcome, self._work(record), bool(record.planned.all()))

        rows = [
            row(event, phase, walk.after(phase, kicks, _TEMPLATE_TICKS))
            for phase in self._phases
            for event, kicks in self.events.items()
        ]
        commanded = walk.commanded(self._stride, walk.first // self._ticks_per_step)
        return [*rows, row(self._command, 0, commanded.after(0, np.zeros((0, 2)), 2 * _TEMPLATE_TICKS))]

    def _work(self, record: Record) -> float:
        """Positive mechanical work of the horizontal force along the bounded axes [J/kg]."""
        eta = self._free.walk.vhip.eta[(record.first + np.arange(len(record.states))) % self._ticks_per_step]
        com, velocity, zmp = np.moveaxis(record.states[:, self._orbit.axes], 2, 0)
        return float(np.maximum(eta[:, None] * (com - zmp) * velocity, 0.0).sum() * self._tick)


class RobotWorth(Worth):
    """On the robot: the kick is the impulse of a push of 0.1 s [N s], the push a force [N]."""

    plant = "robot"

    def __init__(self, scenario: Scenario, kick: float, push: float, command: float, phases: Sequence[int]) -> None:
        super().__init__(scenario, kick, push, command, phases)
        step = self._ticks_per_step * self._tick
        self._forces = {f"kick {kick:g} N s": (kick / 0.1, 0.1), f"push {push:g} N, {step:g} s": (push, step)}
        self._free = PushedWalk(in_case(scenario, NONE), self._phases, with_action=True)
        self._orbit = SafeOrbit(scenario, self._undisturbed(self._free))

    def _undisturbed(self, walk: PushedWalk) -> Record:
        still = walk.trial(self._phases[0], np.zeros(3), 0.1, 2.2 * self._ticks_per_step * self._tick)
        return still.record(self._tick)

    def _events(self, case: str, gamma: float, scenario: Scenario) -> list[Measures]:
        walk = self._free if case == NONE else PushedWalk(scenario, self._phases, with_action=True)
        undisturbed = self._undisturbed(walk)

        def row(event: str, phase: int, trial: Trial) -> Measures:
            outcome = self._orbit.outcome(trial.record(self._tick), undisturbed)
            return self._row(case, gamma, event, phase, outcome, self._work(trial), trial.survived)

        rows = [
            row(event, phase, walk.trial(phase, np.array([force, 0.0, 0.0]), duration, _ROBOT_SECONDS))
            for phase in self._phases
            for event, (force, duration) in self._forces.items()
        ]
        faster = PushedWalk(_commanded(scenario, self._stride), self._phases[:1], with_action=True)
        trial = faster.trial(self._phases[0], np.zeros(3), 0.1, _ROBOT_SECONDS)
        return [*rows, row(self._command, self._phases[0], trial)]

    def _work(self, trial: Trial) -> float:
        """Positive mechanical work of the twelve joints [J]."""
        log = trial.log
        return float(np.maximum(log["actuation"] * log["joint_state"][:, 12:], 0.0).sum() * self._tick)


def _commanded(scenario: Scenario, stride: float) -> Scenario:
    """The scenario with steps of another length [m] and the bounds that were made for the right one."""
    barriers = dict(scenario.barriers)
    for name, config in barriers.items():
        if config.bound.follows_orbit and config.bound.stride is None:
            bound = config.bound.model_copy(update={"stride": scenario.gait.stride})
            barriers[name] = config.model_copy(update={"bound": bound})
    gait = scenario.gait.model_copy(update={"stride": stride})
    return scenario.model_copy(update={"gait": gait, "barriers": barriers})
