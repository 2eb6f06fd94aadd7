"""Joint drives that read the encoders: a PD whose torque is computed at a tick and held until the next one."""

from __future__ import annotations

import math

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Diagram
from pydrake.systems.primitives import Adder, MatrixGain, ZeroOrderHold

from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.wiring import Wiring

_STIFF, _DAMPED = 0.5, 0.9
"""Shares of I/T² and I/T [1]: with these a leg in the air comes to rest, for T of 1 to 20 ms."""


def connect_sampled_drives(
    wiring: Wiring, plant: MultibodyPlant, biped: Biped, targets: Diagram, posture: np.ndarray, cutoff: float
) -> None:
    """Connects `joint_targets` and the encoders to the torques of a plant that has no PD of its own.

    τ = kp (q* − q) + kd (q̇* − q̇) + feedforward, with q and q̇ of the encoders and all but the feedforward held from
    tick to tick. It acts a step of the plant after the encoders are read.

    Args:
        posture: q (19,) at the start.
        cutoff: of the encoders' rates [Hz].
    """
    count, builder = len(biped.u_index), wiring.builder
    late = wiring.tick + plant.time_step() + 1.0 / (2.0 * math.pi * cutoff)
    kp, kd = sampled_gains(biped, posture, late)
    order = np.eye(count)[np.argsort(biped.u_index)]
    gains = np.hstack([order @ np.diag(kp), order @ np.diag(kd)])
    wanted = builder.AddNamedSystem("drive_targets", MatrixGain(gains @ np.kron(np.eye(2), order.T)))
    found = builder.AddNamedSystem("drive_encoders", MatrixGain(-gains))
    error = builder.AddNamedSystem("drive_errors", Adder(2, count))
    held = builder.AddNamedSystem("drive_torques", ZeroOrderHold(wiring.tick, count))
    torque = builder.AddNamedSystem("drives", Adder(2, count))
    builder.Connect(targets.GetOutputPort("plant_desired_state"), wanted.get_input_port())
    builder.Connect(wiring.port("encoders"), found.get_input_port())
    builder.Connect(wanted.get_output_port(), error.get_input_port(0))
    builder.Connect(found.get_output_port(), error.get_input_port(1))
    builder.Connect(error.get_output_port(), held.get_input_port())
    builder.Connect(held.get_output_port(), torque.get_input_port(0))
    builder.Connect(targets.GetOutputPort("plant_actuation"), torque.get_input_port(1))
    builder.Connect(torque.get_output_port(), plant.get_actuation_input_port())


def sampled_gains(biped: Biped, posture: np.ndarray, late: float) -> tuple[np.ndarray, np.ndarray]:
    """kp [N m/rad] and kd [N m s/rad] of each joint (12,), those of the robot as far as a late PD is stable.

    A joint that sees the inertia I and whose torque answers its motion after T oscillates if kp is above some share of
    I/T², or kd above one of I/T. I is that of the joint alone on a robot in the air, 1/(M⁻¹)_jj, which is the least.

    Args:
        posture: q (19,), at which I is taken.
        late: T, a tick and all delays [s].
    """
    context = biped.context()
    biped.plant.SetPositions(context, posture)
    inertia = 1.0 / np.diag(np.linalg.inv(biped.plant.CalcMassMatrix(context)))[biped.v_index]
    return np.minimum(biped.kp, _STIFF * inertia / late**2), np.minimum(biped.kd, _DAMPED * inertia / late)
