"""A walk in steady state that is pushed many times: one diagram, and one saved context for each phase of the gait."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from pydrake.multibody.plant import ContactResults
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import Context, Diagram

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.run_log import FELL, RunLog
from pdhocbf_drake.simulation.scenario import Push, Scenario
from pdhocbf_drake.simulation.simulate import make_diagram
from pdhocbf_drake.studies.shared.endings import (
    DID_NOT_WALK_ON,
    GAVE_UP,
    LEGS_TOUCHED,
    SURVIVED,
    soles_overlap,
    walks_on,
)

_SETTLING_GAITS = 3  # from the standing start to steady walking
_GROUND = 0  # index of the world's body, which is the ground


class Trial(NamedTuple):
    """How one pushed walk ended, and its log from the push on."""

    ending: str
    log: RunLog

    @property
    def survived(self) -> bool:
        """Whether the walk went on."""
        return self.ending == SURVIVED


class PushedWalk:
    """The walk of a scenario, on the robot or on the template, in steady state.

    Attributes:
        scenario: the scenario; its own pushes are left out.
        phases: ticks of the gait at which pushes may begin; 0 is the first tick of a step on the first stance foot.

    Raises:
        InputError: the scenario is no walk without an end, a phase is no tick of the gait, or the robot falls without
            being pushed.
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
        self._legs = LegContact(self._diagram, Biped.load(scenario.robot)) if scenario.system == "biped" else None
        self._first = gait.start_steps * gait.ticks_per_step + _SETTLING_GAITS * gait.ticks_per_gait
        self._saved = self._settle()

    def _settle(self) -> dict[int, Context]:
        """A context at each phase of the gait after the settling ones."""
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
        """Pushes the torso with `force` (3,) [N] for `duration` [s] and simulates `watch` seconds from the push on."""
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
                    ending = LEGS_TOUCHED
                    break
        except RuntimeError:  # raised by Drake's plant where a state is not finite
            ending = GAVE_UP
        log = self._logged.recorded(simulator.get_context())
        if ending == SURVIVED and not walks_on(self.scenario.gait, log):
            ending = DID_NOT_WALK_ON
        return Trial(ending, log)


class LegContact:
    """Whether the legs of the robot in a diagram touch: two bodies by contact, or the soles seen from above."""

    def __init__(self, diagram: Diagram, biped: Biped) -> None:
        self._plant = diagram.GetSubsystemByName("plant")
        self._estimator = diagram.GetSubsystemByName("state_estimator")
        self._halves = np.array([biped.soles[side].half_size for side in ("left", "right")])

    def touch(self, context: Context) -> bool:
        """Whether they touch, in a context of the whole diagram."""
        plant = self._plant.GetMyContextFromRoot(context)
        if _bodies_touch(self._plant.get_contact_results_output_port().Eval(plant)):
            return True
        estimator = self._estimator.GetMyContextFromRoot(context)
        feet = self._estimator.GetOutputPort("foot_state").Eval(estimator).reshape(2, 6)
        return soles_overlap(feet[:, [0, 1, 5]], self._halves)


def _bodies_touch(results: ContactResults) -> bool:
    """Whether two bodies of the robot touch each other."""
    pairs = (results.point_pair_contact_info(i) for i in range(results.num_point_pair_contacts()))
    return any(int(p.bodyA_index()) != _GROUND and int(p.bodyB_index()) != _GROUND for p in pairs)
