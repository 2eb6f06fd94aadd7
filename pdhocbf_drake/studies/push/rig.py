"""Pushes what is already walking: one diagram, one saved context a phase, many trials."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import Context

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.run_log import FELL, RunLog
from pdhocbf_drake.simulation.scenario import Push, Scenario
from pdhocbf_drake.simulation.simulate import make_diagram
from pdhocbf_drake.studies.push.endings import ASTRAY, GAVE_UP, LEGS, SURVIVED, walks_on
from pdhocbf_drake.studies.push.legs import LegWatch

_SETTLING_GAITS = 3  # from the standing start to steady walking


class Trial(NamedTuple):
    """One push: how it ended, and what was recorded from the push on."""

    ending: str
    log: RunLog

    @property
    def survived(self) -> bool:
        """Whether the walk went on."""
        return self.ending == SURVIVED


class PushRig:
    """The robot (or the template) of a scenario in steady walking, ready to be pushed at each phase of the gait.

    Attributes:
        scenario: what walks; its own pushes are left out.
        phases: the ticks of the gait at which pushes may begin; 0 is the first tick of a step on the first stance foot.

    Raises:
        InputError: nothing walks in the scenario, a phase is no tick of the gait, or the robot falls unpushed.
    """

    def __init__(self, scenario: Scenario, phases: Iterable[int]) -> None:
        if scenario.system == "van_der_pol":
            raise InputError("scenario.system: only what walks can be pushed, 'biped' or 'vhip' (given: 'van_der_pol')")
        if scenario.gait.walk_steps is not None:
            raise InputError("gait.walk_steps: pushes are tried on a walk without an end (null)")
        self.phases = sorted(set(phases))
        gait = scenario.gait
        if not self.phases or self.phases[0] < 0 or self.phases[-1] >= gait.ticks_per_gait:
            raise InputError(f"phases are ticks of the gait, 0 to {gait.ticks_per_gait - 1} (given: {self.phases})")
        placeholder = Push(time=0.0, force=(0.0, 0.0, 0.0))
        self.scenario = scenario.model_copy(update={"pushes": (placeholder,)})
        self._logged = make_diagram(self.scenario)
        self._diagram = self._logged.diagram
        self._schedule = self._diagram.GetSubsystemByName("push_schedule")
        self._legs = LegWatch(self._diagram, Biped.load(scenario.robot)) if scenario.system == "biped" else None
        self._first = gait.start_steps * gait.ticks_per_step + _SETTLING_GAITS * gait.ticks_per_gait
        self._saved = self._walk()

    def _walk(self) -> dict[int, Context]:
        """Contexts at each phase of the gait after the settling ones."""
        simulator = Simulator(self._diagram)
        for adjust in self._logged.adjust:
            adjust(simulator.get_mutable_context())
        simulator.Initialize()
        saved = {}
        for phase in self.phases:
            status = simulator.AdvanceTo((self._first + phase) * self.scenario.gait.tick)
            if status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition:
                raise InputError(f"scenario {self.scenario.name}: the robot falls before it is pushed")
            self._logged.forget(simulator.get_mutable_context())
            saved[phase] = simulator.get_context().Clone()
        return saved

    def trial(self, phase: int, force: np.ndarray, duration: float = 0.1, watch: float = 3.2) -> Trial:
        """Pushes the torso with `force` (3,) [N] for `duration` [s] and watches for `watch` seconds."""
        tick = self.scenario.gait.tick
        context = self._saved[phase].Clone()
        first = self._first + phase
        self._schedule.push(
            self._schedule.GetMyMutableContextFromRoot(context), 0, force, first, first + max(1, round(duration / tick))
        )
        simulator = Simulator(self._diagram, context)
        simulator.Initialize()
        ending = SURVIVED
        try:
            for k in range(1, round(watch / tick) + 1):
                status = simulator.AdvanceTo((first + k) * tick)
                if status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition:
                    ending = FELL
                    break
                if self._legs is not None and self._legs.touch(simulator.get_context()):
                    ending = LEGS
                    break
        except RuntimeError:  # Drake's plant gives up on numbers that are none
            ending = GAVE_UP
        log = self._logged.recorded(simulator.get_context())
        if ending == SURVIVED and not walks_on(self.scenario.gait, log):
            ending = ASTRAY
        return Trial(ending, log)
