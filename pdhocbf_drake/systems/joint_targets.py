"""Set points of the plant's own joint PD at each of its steps, made of Drake's own C++ blocks."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import AffineSystem, MatrixGain

from pdhocbf_drake.robot import Biped

LATENCY = 2.0
"""Plant steps from a measurement to the effect of the plan made from it, calibrated on the walk.

One until the plan is read and one through the integral, less the half by which the target leads the integral, and a
half that the robot's own response takes. With 1.5 the robot loses 9 mm/s of its barrier's margin at a plant step of
5 ms, with 1.0 it falls behind its command (0.342 instead of 0.375 m/s), and with 2.5 the ZMP leaves its box in 8 % of
the ticks instead of 6.
"""


def joint_targets(biped: Biped, initial: np.ndarray, time_step: float) -> Diagram:
    """Joint targets that move at constant rates between ticks, in the order of the plant's actuators.

    The plant's PD is implicit: over a whole step it holds one target, that of the step's middle, which leads the
    integral of the rates by half a step.

    Input ports:
        desired_state (24): targets and rates; the rates are integrated at the plant's step, so that targets don't jump.
        feedforward (12) [N m].
    Output ports:
        plant_desired_state (24): for `MultibodyPlant.get_desired_state_input_port` [rad, rad/s].
        plant_actuation (12): the feedforward, for `MultibodyPlant.get_actuation_input_port` [N m].

    Args:
        initial: joint positions at the start (12,) [rad].
        time_step: the plant's [s].
    """
    count = len(biped.u_index)
    order, none, one = np.eye(count)[np.argsort(biped.u_index)], np.zeros((count, count)), np.eye(count)
    builder = DiagramBuilder()
    # The integrator starts from zero in every context, so it holds the displacement from the initial posture.
    desired = AffineSystem(
        A=one,
        B=np.hstack([none, time_step * order]),
        f0=np.zeros(count),
        C=np.vstack([one, none]),
        D=np.block([[none, 0.5 * time_step * order], [none, order]]),
        y0=np.concatenate([order @ initial, np.zeros(count)]),
        time_period=time_step,
    )
    builder.AddNamedSystem("desired", desired)
    motors = builder.AddNamedSystem("motors", MatrixGain(order))
    builder.ExportInput(desired.get_input_port(), "desired_state")
    builder.ExportInput(motors.get_input_port(), "feedforward")
    builder.ExportOutput(desired.get_output_port(), "plant_desired_state")
    builder.ExportOutput(motors.get_output_port(), "plant_actuation")
    diagram = builder.Build()
    diagram.set_name("joint_targets")
    return diagram
