"""Feet that feel the ground: the loads that they carry, and the block that takes the ground for where they meet it."""

from __future__ import annotations

from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import System

from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.build import Walk
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.wiring import Wiring
from pdhocbf_drake.systems.foot_loads import FootLoads, SensedLoads
from pdhocbf_drake.systems.footing import Footing

_CARRIES = 0.05  # share of the weight from which a foot carries load; sensors also feel a sole that is swung


def feels_ground(scenario: Scenario) -> bool:
    """Whether the feet of a scenario's robot react to the ground: where that is not level, unless it says."""
    said = scenario.biped.feels_ground
    return bool(scenario.ground) if said is None else said


def footing_of(scenario: Scenario, walk: Walk, biped: Biped) -> Footing | None:
    """The block of feet that feel the ground; None for others."""
    if not feels_ground(scenario):
        return None
    sensed = scenario.measurement.source == "sensors"
    met = scenario.measurement.estimator.load_on if sensed else _CARRIES
    return Footing(walk.gait, (_CARRIES * biped.weight, met * biped.weight), walk.mpc.config.delay_ticks)


def add_loads(wiring: Wiring, plant: MultibodyPlant, biped: Biped, sensed: bool) -> None:
    """Offers `foot_load`, and as its measured copy what the sensors above the soles say, where there are any."""
    loads = wiring.add("foot_loads", FootLoads(plant, biped))
    wiring.builder.Connect(plant.get_contact_results_output_port(), loads.get_input_port())
    wiring.log("foot_load")
    if sensed:
        wiring.connect(wiring.add("sensed_loads", SensedLoads()), "force_torque", "estimator_status")
        wiring.offer("foot_load", wiring.port("foot_load_estimate"), measured=True)


def connect_footing(wiring: Wiring, footing: System, kinematics: System) -> None:
    """Connects the block, and gives inverse kinematics its targets in place of what is planned."""
    uneven = footing.HasInputPort("ground_reference")
    wiring.connect(footing, "gait_phase", "foot_reference", "resumed", *["ground_reference"] * uneven)
    wiring.connect(footing, "foot_state", "foot_load", measured=True)
    for name in ("foot", "ground"):
        wiring.builder.Connect(wiring.port(f"{name}_target"), kinematics.GetInputPort(f"{name}_reference"))
