"""The robot without its controller: the same plant, standing still under the same joint PD."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, MatrixGain

from pdhocbf_drake.biped import Biped
from pdhocbf_drake.simulation.biped_diagram import add_robot, initial_posture
from pdhocbf_drake.simulation.build import Walk
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.systems.joint_pd import joint_pd


def bare_plant(scenario: Scenario, walk: Walk, biped: Biped) -> Diagram:
    """Plant, contact and PD of the scenario, with the first posture as its only target and nothing logged."""
    builder = DiagramBuilder()
    posture = initial_posture(walk, biped)
    plant = add_robot(builder, scenario, biped, posture)
    joints = posture[biped.q_index]
    pd = builder.AddNamedSystem("joint_pd", joint_pd(biped, joints, plant.time_step()))
    select = np.zeros((24, 37))
    select[np.arange(12), biped.q_index] = select[12 + np.arange(12), 19 + biped.v_index] = 1.0
    sources = {
        "desired_state": ConstantVectorSource(np.concatenate([joints, np.zeros(12)])),
        "feedforward": ConstantVectorSource(np.zeros(12)),
        "estimated_state": MatrixGain(select),
    }
    for port, source in sources.items():
        builder.AddSystem(source)
        builder.Connect(source.get_output_port(), pd.GetInputPort(port))
    builder.Connect(plant.get_state_output_port(), sources["estimated_state"].get_input_port())
    motors = builder.AddSystem(MatrixGain(np.eye(12)[np.argsort(biped.u_index)]))
    builder.Connect(pd.GetOutputPort("actuation"), motors.get_input_port())
    builder.Connect(motors.get_output_port(), plant.get_actuation_input_port())
    return builder.Build()
