"""The robot without its controller: the same plant and joint PD, standing still, or walking from a recording."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder, System
from pydrake.systems.primitives import ConstantVectorSource, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.biped_plant import add_robot, connect_joints, initial_posture
from pdhocbf_drake.simulation.build import Walk
from pdhocbf_drake.simulation.drake_config import plant_config
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.systems.joint_targets import joint_targets


def bare_plant(scenario: Scenario, walk: Walk, biped: Biped) -> Diagram:
    """Plant, contact and PD of the scenario, with the first posture as its only target and nothing logged."""
    joints = initial_posture(walk, biped)[biped.q_index]
    still = ConstantVectorSource(np.concatenate([joints, np.zeros(12)]))
    return _driven(scenario, walk, biped, still, ConstantVectorSource(np.zeros(12)))


def replayed_plant(scenario: Scenario, walk: Walk, biped: Biped, log: RunLog) -> Diagram:
    """The same, driven by the joint targets and torques of a recorded run, without Python in the loop.

    With the same inputs at the same steps it repeats the recorded walk bit for bit: its time is the walking plant's
    own part of the closed loop.
    """
    # The plan of tick k reaches the plant in its first step after k: the targets change between these two steps.
    between = 0.5 * plant_config(scenario.plant).time_step
    changes = np.concatenate([[-scenario.tick], log.time[:-1] + between, [log.time[-1] + scenario.tick]])
    held = (np.vstack([log[name], log[name][-1:]]).T for name in ("desired_state", "feedforward"))
    sources = [TrajectorySource(PiecewisePolynomial.ZeroOrderHold(changes, values)) for values in held]
    return _driven(scenario, walk, biped, *sources)


def _driven(scenario: Scenario, walk: Walk, biped: Biped, desired: System, feedforward: System) -> Diagram:
    builder = DiagramBuilder()
    posture = initial_posture(walk, biped)
    plant = add_robot(builder, scenario, biped, posture)
    targets = builder.AddNamedSystem("joint_targets", joint_targets(biped, posture[biped.q_index], plant.time_step()))
    for port, source in (("desired_state", desired), ("feedforward", feedforward)):
        builder.AddSystem(source)
        builder.Connect(source.get_output_port(), targets.GetInputPort(port))
    connect_joints(builder, plant, biped, targets)
    return builder.Build()
