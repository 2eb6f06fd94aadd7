"""Wires the blocks: the only place that connects ports."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import LogVectorOutput, Multiplexer, VectorLogSink

from pdhocbf_drake.oscillator.van_der_pol_tube import VanDerPolTube
from pdhocbf_drake.simulation.build import Walk
from pdhocbf_drake.simulation.disturbance import SEEN, add_measurement
from pdhocbf_drake.simulation.pushes import timed_forces
from pdhocbf_drake.simulation.run_log import FINISHED, RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.systems.barrier_schedule import BarrierSchedule
from pdhocbf_drake.systems.gait_reference import GaitReference
from pdhocbf_drake.systems.lean_detector import LeanDetector
from pdhocbf_drake.systems.mpc_controller import MpcController
from pdhocbf_drake.systems.oscillator import Oscillator, TubeFilter
from pdhocbf_drake.systems.push_schedule import PushSchedule
from pdhocbf_drake.systems.vhip_plant import VhipPlant


@dataclass
class LoggedDiagram:
    """A diagram whose logged signals (`simulation.signals`) all go into one sink.

    Attributes:
        sink: takes one sample a tick. Every sink costs 1 µs at each step of the plant, so there is one.
        columns: where each signal stands in a sample.
        adjust: what is to be done to a new context of the diagram: seeds and parameters.
    """

    diagram: Diagram
    sink: VectorLogSink
    columns: dict[str, slice]
    adjust: list[Callable[[Context], None]] = field(default_factory=list)

    def recorded(self, context: Context, ending: str = FINISHED) -> RunLog:
        """What has been logged in a context of the diagram, as a copy."""
        log = self.sink.FindLog(context)
        samples = log.data().T
        signals = {name: np.ascontiguousarray(samples[:, place]) for name, place in self.columns.items()}
        return RunLog(signals, log.sample_times().copy(), ending)

    def forget(self, context: Context) -> None:
        """Empties the log of a context."""
        self.sink.FindMutableLog(context).Clear()


@dataclass
class Wiring:
    """A diagram being built: blocks by name, ports by name, and the names of those that are logged."""

    tick: float
    builder: DiagramBuilder = field(default_factory=DiagramBuilder)
    adjust: list[Callable[[Context], None]] = field(default_factory=list)
    _ports: dict[str, OutputPort] = field(default_factory=dict)
    _logged: list[str] = field(default_factory=list)

    def add(self, name: str, system: System) -> System:
        """Adds a block; its vector outputs are known by their port's name from then on."""
        self.builder.AddNamedSystem(name, system)
        for i in range(system.num_output_ports()):
            port = system.get_output_port(i)
            self._ports.setdefault(port.get_name(), port)
        return system

    def offer(self, name: str, port: OutputPort) -> None:
        """Makes an output port known under another name."""
        self._ports[name] = port

    def port(self, name: str) -> OutputPort:
        """The output port known under a name."""
        return self._ports[name]

    def connect(self, system: System, *names: str) -> None:
        """Connects input ports to the output ports of the same name."""
        for name in names:
            self.builder.Connect(self._ports[name], system.GetInputPort(name))

    def connect_seen(self, system: System, *names: str) -> None:
        """Connects input ports to what is told of the output ports of the same name: late or noisy, if it is."""
        for name in names:
            self.builder.Connect(self._ports.get(name + SEEN, self._ports[name]), system.GetInputPort(name))

    def log(self, *names: str) -> None:
        """Logs output ports at every tick."""
        self._logged += names

    def build(self, name: str) -> LoggedDiagram:
        """The diagram, with one sink for all that is logged."""
        ports = [self._ports[signal] for signal in self._logged]
        signals = self.builder.AddNamedSystem("signals", Multiplexer([port.size() for port in ports]))
        for i, port in enumerate(ports):
            self.builder.Connect(port, signals.get_input_port(i))
        sink = LogVectorOutput(signals.get_output_port(), self.builder, self.tick)
        sink.set_name("log")
        ends = np.cumsum([port.size() for port in ports]).tolist()
        columns = {s: slice(end - port.size(), end) for s, port, end in zip(self._logged, ports, ends, strict=True)}
        diagram = self.builder.Build()
        diagram.set_name(name)
        return LoggedDiagram(diagram, sink, columns, self.adjust)


def add_controller(
    wiring: Wiring, walk: Walk, initial: np.ndarray, feet: np.ndarray, latency: float = 0.0
) -> MpcController:
    """Adds clock, barriers and MPC; whatever measures must offer `lip_state` before `connect_controller`."""
    wiring.add("gait_reference", GaitReference(walk.gait))
    if walk.barriers:
        horizon = walk.mpc.config.horizon
        wiring.add("barrier_schedule", BarrierSchedule(walk.axes, walk.barriers, walk.gait.period, horizon))
    controller = MpcController(walk.mpc, initial, feet, walk.names, latency)
    wiring.add("mpc_controller", controller)
    return controller


def connect_controller(wiring: Wiring, walk: Walk, controller: System) -> None:
    """Closes the loop from `lip_state` and logs the controller's signals."""
    wiring.connect(controller, "gait_phase")
    wiring.connect(wiring.port("gait_phase").get_system(), "last_step")
    wiring.connect_seen(controller, "lip_state")
    if walk.barriers:
        wiring.connect(wiring.port("h").get_system(), "gait_phase", "lip_state")
        wiring.connect(controller, "velocity_bound")
        wiring.log("velocity_bound", "h", "barrier_slack")
    wiring.log("gait_phase", "com_height", "lip_state", "com_reference", "zmp_reference", "zmp_box", "stance_plan")
    wiring.log("solver_status", "unmet")


def start_of(walk: Walk) -> tuple[np.ndarray, np.ndarray]:
    """[c, v, p] per axis (2, 3), at rest between the feet, and the feet's centres (2, 2)."""
    return np.zeros((2, 3)), walk.gait.feet_at_start


def oscillator_diagram(scenario: Scenario) -> LoggedDiagram:
    """The Van der Pol oscillator and the filter that keeps it in its tube."""
    tube = VanDerPolTube(scenario.van_der_pol)
    wiring = Wiring(tube.config.tick)
    tube_filter = wiring.add("tube_filter", TubeFilter(tube))
    oscillator = wiring.add("oscillator", Oscillator(tube))
    wiring.connect(oscillator, "oscillator_input")
    wiring.connect(tube_filter, "oscillator_state")
    wiring.log("oscillator_state", "oscillator_input", "h", "solver_status", "barrier_slack")
    return wiring.build("van_der_pol")


def vhip_diagram(scenario: Scenario, walk: Walk) -> LoggedDiagram:
    """The controller on the template itself."""
    wiring = Wiring(walk.gait.config.tick)
    initial, feet = start_of(walk)
    controller = add_controller(wiring, walk, initial, feet)
    plant = VhipPlant(walk.vhip, initial, scenario.vhip.mass)
    wiring.add("vhip", plant)
    wiring.connect(plant, "gait_phase", "zmp_reference")
    if scenario.pushes:
        wiring.add("push_schedule", PushSchedule(timed_forces(scenario), wiring.tick))
        wiring.connect(plant, "push")
        wiring.log("push")
    detector = wiring.add("lean_detector", LeanDetector(walk.gait.config.com_height, wiring.tick))
    wiring.connect(detector, "lip_state")
    add_measurement(wiring, scenario.measurement, scenario.seed, "lip_state")
    connect_controller(wiring, walk, controller)
    return wiring.build("vhip_walk")
