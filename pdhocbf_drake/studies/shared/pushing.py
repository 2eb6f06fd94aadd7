"""A walk in steady state that is pushed many times: one diagram, and one saved context for each phase of the gait."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import Context, Diagram

from pdhocbf_drake.analysis.plan_frame import plan_over_stance
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.loop import control
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.simulation.run_log import FELL, RunLog
from pdhocbf_drake.simulation.scenario import Push, Scenario
from pdhocbf_drake.simulation.simulate import make_diagram
from pdhocbf_drake.studies.shared import endings
from pdhocbf_drake.studies.shared.cases import NONE, in_case
from pdhocbf_drake.studies.shared.measures import Record, WithoutBarriers
from pdhocbf_drake.systems.signals import places
from pdhocbf_drake.systems.unbundled import leaf_of
from pdhocbf_drake.walking.frame import turned

_SETTLING_GAITS = 3  # from the standing start to steady walking
_GROUND = 0  # index of the world's body, which is the ground
_NOW = places("stance_plan", "x_now", "y_now")
(_REASON,) = places("solver_status", "reason")


class Trial(NamedTuple):
    """One pushed walk.

    Attributes:
        ending: how it ended, one of `shared.endings`.
        log: from the push on.
        action: of the barriers at each row of the log, see `measures.ACTS`, shape (T,) [m/s]; zero unless the walk has
            barriers and measures it.
    """

    ending: str
    log: RunLog
    action: np.ndarray

    @property
    def survived(self) -> bool:
        """Whether the walk went on."""
        return self.ending == endings.SURVIVED

    def record(self, tick: float) -> Record:
        """The trial as a record for `SafeOrbit`; `tick` is the sampling interval δ [s]."""
        log = plan_over_stance(self.log)
        h = log["h"] if "h" in log else np.empty((len(log), 0))
        planned = log.element("solver_status", "fallbacks") == 0
        states, stances = log["lip_state"].reshape(-1, 2, 3), log["stance_plan"][:, _NOW]
        return Record(round(log.time[0] / tick), states, stances, h, self.action, planned)


class PushedWalk:
    """The walk of a scenario, on the robot or on the template, in steady state.

    Attributes:
        scenario: the scenario without its own pushes.
        phases: ticks of the gait at which pushes may begin; 0 is the first tick of a step on the first stance foot.
        controller: the block of its controller.

    Raises:
        InputError: the scenario is no walk without an end at one command, a phase is no tick of the gait, or the robot
            falls before any push.
    """

    def __init__(self, scenario: Scenario, phases: Iterable[int], with_action: bool = False) -> None:
        """With `with_action` each trial measures the action of the barriers, which takes a second solve a tick."""
        if scenario.system == "van_der_pol":
            raise InputError("scenario.system: only what walks can be pushed, 'biped' or 'vhip' (given: 'van_der_pol')")
        if scenario.gait.walk_steps is not None:
            raise InputError("gait.walk_steps: pushes are tried on a walk without an end (null)")
        _check_one_command(scenario)
        self.phases = sorted(set(phases))
        gait = scenario.gait
        if not self.phases or self.phases[0] < 0 or self.phases[-1] >= gait.ticks_per_gait:
            raise InputError(f"phases are ticks of the gait, 0 to {gait.ticks_per_gait - 1} (given: {self.phases})")
        placeholder = Push(time=0.0, force=(0.0, 0.0, 0.0))
        self.scenario = scenario.model_copy(update={"pushes": (placeholder,)})
        self._logged = make_diagram(self.scenario, form="fused")
        self._diagram = self._logged.diagram
        self._schedule = self._diagram.GetSubsystemByName("push_schedule")
        self._contact = LegContact(self._diagram, Biped.load(scenario.robot)) if scenario.system == "biped" else None
        self.controller = leaf_of(self._diagram.GetSubsystemByName("mpc_controller"))
        compared = with_action and scenario.barriers
        self._free = build_walk(in_case(scenario, NONE)).mpc if compared else None
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

    def trial(
        self, phase: int, force: np.ndarray, duration: float = 0.1, watch: float = 3.2, whole: bool = True
    ) -> Trial:
        """Pushes the torso for `duration` [s] and simulates `watch` seconds from the push on.

        `force` (3,) [N] is along the heading of the stance foot at the push's first tick. A trial that need not be
        `whole` ends as survived once the walk has gone on for a gait, undisturbed and at the commanded velocity, where
        the controller notices disturbances.
        """
        tick = self.scenario.gait.tick
        context = self._saved[phase].Clone()
        first, pushed = self._first + phase, max(1, round(duration / tick))
        gait = self.controller.mpc.gait
        ends = not whole and self.controller.mpc.recovery is not None
        force = np.array([*turned((force[0], force[1]), gait.step(first // gait.period).yaw), force[2]])
        self._schedule.push(self._schedule.GetMyMutableContextFromRoot(context), 0, force, first, first + pushed)
        simulator = Simulator(self._diagram, context)
        simulator.Initialize()
        ending = endings.SURVIVED
        calm, actions = 0, []
        free = None if self._free is None else WithoutBarriers(self._free)
        try:
            for k in range(1, round(watch / tick) + 1):
                if free is not None:
                    actions.append(self._action(free, simulator.get_context()))
                status = simulator.AdvanceTo((first + k) * tick)
                if status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition:
                    ending = FELL
                    break
                if self._contact is not None and self._contact.touch(simulator.get_context()):
                    ending = endings.LEGS_TOUCHED
                    break
                calm = calm + 1 if ends and k > pushed and self._undisturbed(simulator.get_context()) else 0
                if calm and calm % gait.config.ticks_per_gait == 0 and self._walks_on(simulator.get_context()):
                    break
        except RuntimeError:  # raised by Drake's plant where a state is not finite
            ending = endings.GAVE_UP
        log = self._logged.recorded(simulator.get_context())
        if ending == endings.SURVIVED and not endings.walks_on(self.scenario.gait, log):
            ending = endings.DID_NOT_WALK_ON
        action = np.zeros(len(log))
        action[: len(actions)] = actions[: len(log)]
        return Trial(ending, log, action)

    def _undisturbed(self, context: Context) -> bool:
        """Whether the last plan in a context of the diagram is that of a steady walk."""
        status = self.controller.memory(self.controller.GetMyContextFromRoot(context)).solver_status
        return float(status[_REASON]) <= Reason.CROSS_SOLVED

    def _walks_on(self, context: Context) -> bool:
        return endings.walks_on(self.scenario.gait, self._logged.recorded(context))

    def _action(self, free: WithoutBarriers, context: Context) -> float:
        """The action of the barriers in a context of the diagram before the controller's update [m/s]."""
        block = self.controller
        own = block.GetMyContextFromRoot(context)
        memory, measurement = block.memory(own), block.measurement(own)
        _, plan = control(block.mpc, memory, measurement, block.latency)
        return free.action(memory, measurement, plan, block.latency)


def _check_one_command(scenario: Scenario) -> None:
    """Raises `InputError` for commands under which no gait repeats."""
    if scenario.path:
        raise InputError("path: must be empty where pushes are tried, which needs a walk that repeats")
    commands = scenario.commands
    if len(commands) > 1 or any(command.stop or command.time for command in commands):
        given = f"{len(commands)} commands"
        if len(commands) == 1:
            given = "a stop" if commands[0].stop else f"one from {commands[0].time:g} s on"
        raise InputError(f"commands: pushes are tried on a walk at one command, from 0 s on (given: {given})")


class LegContact:
    """Contact between the legs of the robot in a diagram: of two of its bodies, or by soles that overlap from above."""

    def __init__(self, diagram: Diagram, biped: Biped) -> None:
        self._plant = diagram.GetSubsystemByName("plant")
        self._estimator = diagram.GetSubsystemByName("state_estimator")
        self._halves = np.array([biped.soles[side].half_size for side in ("left", "right")])

    def touch(self, context: Context) -> bool:
        """Whether they touch in a context of the whole diagram."""
        port = self._plant.get_contact_results_output_port()
        results = port.Eval(self._plant.GetMyContextFromRoot(context))
        pairs = (results.point_pair_contact_info(i) for i in range(results.num_point_pair_contacts()))
        if any(int(p.bodyA_index()) != _GROUND and int(p.bodyB_index()) != _GROUND for p in pairs):
            return True
        estimator = self._estimator.GetMyContextFromRoot(context)
        feet = self._estimator.GetOutputPort("foot_state").Eval(estimator).reshape(2, 6)
        return endings.soles_overlap(feet[:, [0, 1, 5]], self._halves)
