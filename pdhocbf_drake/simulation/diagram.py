"""Diagrams of the controller on the template, and of the oscillator with its filter."""

from __future__ import annotations

from pydrake.systems.framework import System

from pdhocbf_drake.oscillator.van_der_pol_tube import VanDerPolTube
from pdhocbf_drake.simulation.build import Walk
from pdhocbf_drake.simulation.disturbance import add_measurement, timed_forces
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.wiring import LoggedDiagram, Wiring
from pdhocbf_drake.systems.barrier_schedule import BarrierSchedule
from pdhocbf_drake.systems.fall_detector import LeanDetector
from pdhocbf_drake.systems.gait_reference import GaitReference
from pdhocbf_drake.systems.mpc_controller import MpcController
from pdhocbf_drake.systems.oscillator import Oscillator, TubeFilter
from pdhocbf_drake.systems.path_reference import PathReference
from pdhocbf_drake.systems.push_schedule import PushSchedule
from pdhocbf_drake.systems.unbundled import unbundled
from pdhocbf_drake.systems.vhip_plant import VhipPlant


def vhip_diagram(scenario: Scenario, walk: Walk) -> LoggedDiagram:
    """clock, barriers -> MPC -> template -> MPC."""
    wiring = Wiring(walk.gait.config.tick)
    controller = add_controller(wiring, walk)
    plant = wiring.add("vhip", VhipPlant(walk.vhip, walk.at_rest, scenario.vhip.mass))
    wiring.connect(plant, "gait_phase", "zmp_reference")
    if scenario.pushes or any(scenario.wind):
        wiring.add("push_schedule", PushSchedule(timed_forces(scenario), wiring.tick))
        wiring.connect(plant, "push")
        wiring.log("push")
    detector = wiring.add("lean_detector", LeanDetector(walk.gait.config.com_height, wiring.tick))
    wiring.connect(detector, "lip_state")
    add_measurement(wiring, scenario.measurement, scenario.seed, lip_state=walk.at_rest.ravel())
    connect_controller(wiring, walk, controller)
    return wiring.build("vhip_walk")


def oscillator_diagram(scenario: Scenario) -> LoggedDiagram:
    """The Van der Pol oscillator and the filter that keeps it in its tube."""
    tube = VanDerPolTube(scenario.van_der_pol)
    wiring = Wiring(tube.config.tick)
    tube_filter = wiring.add("tube_filter", TubeFilter(tube))
    oscillator = wiring.add("oscillator", Oscillator(tube))
    wiring.connect(oscillator, "oscillator_input")
    wiring.connect(tube_filter, "oscillator_state")
    wiring.log("oscillator_state", "oscillator_input", "h", "solver_status", "barrier_slack", "barrier_active")
    return wiring.build("van_der_pol")


def add_controller(wiring: Wiring, walk: Walk, latency: float = 0.0) -> System:
    """Adds clock, barriers and the MPC, whose plan is realised `latency` [s] late.

    `lip_state` must be offered before `connect_controller`.
    """
    wiring.add("gait_reference", unbundled(GaitReference(walk.gait)))
    if walk.gait.turns:
        wiring.add("path_reference", unbundled(PathReference(walk.gait)))
    if walk.barriers:
        schedule = BarrierSchedule(walk.axes, walk.barriers, walk.gait, walk.mpc.config.horizon)
        wiring.add("barrier_schedule", unbundled(schedule))
    controller = MpcController(walk.mpc, walk.at_rest, walk.gait.feet_at_start, walk.names, latency)
    return wiring.add("mpc_controller", unbundled(controller))


def connect_controller(wiring: Wiring, walk: Walk, controller: System) -> None:
    """Closes the loop from `lip_state` and logs the controller's signals."""
    wiring.connect(controller, "gait_phase")
    changes = "last_step", "resumed", *["course"] * walk.gait.turns
    wiring.connect(wiring.port("gait_phase").get_system(), *changes)
    wiring.connect(controller, "lip_state", measured=True)
    path = ("path",) if walk.gait.turns else ()
    if path:
        wiring.connect(wiring.port("path").get_system(), "gait_phase", *changes)
        wiring.builder.ExportInput(controller.GetInputPort("command"), "command")
    if walk.barriers:
        stance = ["stance_plan"] * any(barrier.from_stance for barrier in walk.barriers)
        wiring.connect(wiring.port("h").get_system(), "gait_phase", "lip_state", *changes, *stance, *path)
        wiring.connect(controller, "barrier_bound")
        wiring.log("barrier_bound", "h", "barrier_slack", "barrier_active")
    wiring.log("gait_phase", "com_height", "lip_state", "com_reference", "zmp_reference", "zmp_box", "stance_plan")
    if walk.mpc.config.disturbance is not None:
        wiring.log("input_disturbance")
    wiring.log("solver_status", "unmet", *path, *["command_asked"] * walk.gait.turns)
