"""Diagrams of the controller on the template, and of the oscillator with its filter."""

from __future__ import annotations

from pydrake.systems.framework import System

from pdhocbf_drake.oscillator.van_der_pol_tube import VanDerPolTube
from pdhocbf_drake.simulation.build import Walk
from pdhocbf_drake.simulation.disturbance import add_measurement, timed_forces
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.wiring import Form, LoggedDiagram, Wiring
from pdhocbf_drake.systems.barrier_schedule import BarrierSchedule
from pdhocbf_drake.systems.fall_detector import LeanDetector
from pdhocbf_drake.systems.fused_controller import BodyBlocks, ControllerBlocks, FusedController
from pdhocbf_drake.systems.gait_reference import GaitReference
from pdhocbf_drake.systems.mpc_controller import MpcController
from pdhocbf_drake.systems.oscillator import Oscillator, TubeFilter
from pdhocbf_drake.systems.path_reference import PathReference
from pdhocbf_drake.systems.push_schedule import PushSchedule
from pdhocbf_drake.systems.unbundled import unbundled
from pdhocbf_drake.systems.vhip_plant import VhipPlant


def vhip_diagram(scenario: Scenario, walk: Walk, form: Form = "blocks") -> LoggedDiagram:
    """clock, barriers -> MPC -> template -> MPC."""
    wiring, fused = Wiring(walk.gait.config.tick), form == "fused"
    controller = add_fused_controller(wiring, walk) if fused else add_controller(wiring, walk)
    plant = wiring.add("vhip", VhipPlant(walk.vhip, walk.at_rest, scenario.vhip.mass, walk.gait))
    wiring.connect(plant, "gait_phase", "zmp_reference")
    if scenario.pushes or any(scenario.wind):
        wiring.add("push_schedule", PushSchedule(timed_forces(scenario), wiring.tick))
        wiring.connect(plant, "push")
        wiring.log("push")
    detector = wiring.add("lean_detector", LeanDetector(walk.gait.config.com_height, wiring.tick))
    wiring.connect(detector, "lip_state")
    add_measurement(wiring, scenario.measurement, scenario.seed, lip_state=walk.at_rest.ravel())
    if fused:
        connect_fused_controller(wiring, walk, controller)
    else:
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
    blocks = controller_blocks(walk, latency)
    wiring.add("gait_reference", unbundled(blocks.clock))
    if blocks.path is not None:
        wiring.add("path_reference", unbundled(blocks.path))
    if blocks.schedule is not None:
        wiring.add("barrier_schedule", unbundled(blocks.schedule))
    return wiring.add("mpc_controller", unbundled(blocks.controller))


def controller_blocks(walk: Walk, latency: float = 0.0) -> ControllerBlocks:
    """Clock, barriers and the MPC."""
    gait, horizon = walk.gait, walk.mpc.config.horizon
    return ControllerBlocks(
        GaitReference(gait),
        MpcController(walk.mpc, walk.at_rest, gait.feet_at_start, walk.names, latency),
        BarrierSchedule(walk.axes, walk.barriers, gait, horizon) if walk.barriers else None,
        PathReference(gait) if gait.turns else None,
    )


def add_fused_controller(wiring: Wiring, walk: Walk, latency: float = 0.0, body: BodyBlocks | None = None) -> System:
    """The same as one block, with those of a robot."""
    fused = FusedController(controller_blocks(walk, latency), body)
    return wiring.add("mpc_controller", unbundled(fused))


def connect_controller(wiring: Wiring, walk: Walk, controller: System) -> None:
    """Closes the loop from `lip_state`, and logs the controller's signals."""
    wiring.connect(controller, "gait_phase")
    changes = "last_step", "resumed", *["course"] * walk.gait.turns
    wiring.connect(wiring.port("gait_phase").get_system(), *changes)
    wiring.connect(controller, "lip_state", measured=True)
    path = ("path",) if walk.gait.turns else ()
    if path:
        wiring.connect(wiring.port("path").get_system(), "gait_phase", *changes)
        wiring.builder.ExportInput(controller.GetInputPort("command"), "command")
    if walk.barriers:
        from_stance, schedule = _from_stance(walk), wiring.port("h").get_system()
        wiring.connect(schedule, "gait_phase", *changes, *["stance_plan"] * from_stance, *path)
        wiring.builder.Connect(wiring.true_state(from_stance), schedule.GetInputPort("lip_state"))
        wiring.connect(controller, "barrier_bound")
    log_controller(wiring, walk)


def connect_fused_controller(wiring: Wiring, walk: Walk, controller: System) -> None:
    """The same of the one block."""
    wiring.connect(controller, "lip_state", measured=True)
    if walk.gait.turns:
        wiring.builder.ExportInput(controller.GetInputPort("command"), "command")
    if walk.barriers:
        wiring.builder.Connect(wiring.true_state(_from_stance(walk)), controller.GetInputPort("true_state"))
    log_controller(wiring, walk)


def _from_stance(walk: Walk) -> bool:
    return any(barrier.from_stance for barrier in walk.barriers)


def log_controller(wiring: Wiring, walk: Walk) -> None:
    """Logs the controller's signals."""
    path = ("path",) if walk.gait.turns else ()
    if walk.barriers:
        wiring.log("barrier_bound", "h", "barrier_slack", "barrier_active")
    wiring.log("gait_phase", "com_height", "lip_state", "com_reference", "zmp_reference", "zmp_box", "stance_plan")
    if walk.mpc.config.disturbance is not None:
        wiring.log("input_disturbance")
    wiring.log("solver_status", "unmet", *path, *["command_asked"] * walk.gait.turns)
