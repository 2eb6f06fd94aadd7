"""Sensors on the simulated robot, made of Drake's own blocks as far as they go, and the estimator that reads them."""

from __future__ import annotations

import math

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context
from pydrake.systems.primitives import AffineSystem, DiscreteTimeIntegrator, LinearSystem, Multiplexer
from pydrake.systems.sensors import Accelerometer, Gyroscope, RotaryEncoders

from pdhocbf_drake.estimation.config import EncoderConfig, ForceTorqueConfig, ImuConfig, SensorsConfig, samples_in_tick
from pdhocbf_drake.robot import SIDES, Biped, Side
from pdhocbf_drake.robot.model import sole_frame_name
from pdhocbf_drake.simulation.noise import add_noise
from pdhocbf_drake.simulation.wiring import Wiring
from pdhocbf_drake.systems.sensor_faults import SensorFaults
from pdhocbf_drake.systems.sensors import ForceTorque, Imu, SoleWrenches
from pdhocbf_drake.systems.unbundled import unbundled


def add_sensors(
    wiring: Wiring, config: SensorsConfig, seed: int, plant: MultibodyPlant, biped: Biped, joints: np.ndarray
) -> None:
    """Offers `imu`, `encoders` and `force_torque`, with the faults that the scenario has.

    Args:
        seed: of biases, offsets and noise.
        joints: angles at the start (12,) [rad].
    """
    drawn = np.random.default_rng(seed)
    _add_imu(wiring, config.imu, plant, biped, drawn, seed)
    samples = samples_in_tick(config.encoders.rate, wiring.tick, plant.time_step())
    _add_encoders(wiring, config.encoders, joints, drawn, wiring.tick / samples)
    _add_force_torque(wiring, config.force_torque, plant, biped, drawn, seed)
    if config.faults:
        faults = wiring.add("sensor_faults", unbundled(SensorFaults(config.faults, wiring.tick)))
        wiring.connect(faults, "imu", "encoders", "force_torque")
        for i in range(faults.num_output_ports()):
            wiring.offer(faults.get_output_port(i).get_name(), faults.get_output_port(i))


def _add_imu(
    wiring: Wiring, config: ImuConfig, plant: MultibodyPlant, biped: Biped, drawn: np.random.Generator, seed: int
) -> None:
    """Accelerometer and gyroscope at the floating link's origin, their integrals at the plant's steps, and `Imu`.

    The plant moves angles with the rate at a step's end, so the rate is summed up to now, and the specific force, which
    leads to the next step's velocity, up to the step before.
    """
    body, step, one = plant.GetBodyByName(biped.config.base_link), plant.time_step(), np.eye(3)
    accelerometer = Accelerometer(body, RigidTransform(), plant.gravity_field().gravity_vector())
    gyroscope = Gyroscope(body, RigidTransform())
    wiring.builder.AddNamedSystem("accelerometer", accelerometer)
    wiring.builder.AddNamedSystem("gyroscope", gyroscope)
    for sensor in (accelerometer, gyroscope):
        wiring.builder.Connect(plant.get_body_poses_output_port(), sensor.get_body_poses_input_port())
        velocities = plant.get_body_spatial_velocities_output_port()
        wiring.builder.Connect(velocities, sensor.get_body_velocities_input_port())
    accelerations = plant.get_body_spatial_accelerations_output_port()
    wiring.builder.Connect(accelerations, accelerometer.get_body_accelerations_input_port())
    angle = wiring.builder.AddNamedSystem("gyroscope_integral", LinearSystem(one, step * one, one, step * one, step))
    speed = wiring.builder.AddNamedSystem("accelerometer_integral", DiscreteTimeIntegrator(3, step))
    wiring.builder.Connect(gyroscope.get_output_port(), angle.get_input_port())
    wiring.builder.Connect(accelerometer.get_output_port(), speed.get_input_port())
    both = wiring.builder.AddNamedSystem("imu_integrals", Multiplexer([3, 3]))
    wiring.builder.Connect(angle.get_output_port(), both.get_input_port(0))
    wiring.builder.Connect(speed.get_output_port(), both.get_input_port(1))
    bias = np.repeat([config.gyro_bias, config.accelerometer_bias], 3) * drawn.standard_normal(6)
    samples = samples_in_tick(config.rate, wiring.tick, step)
    imu = wiring.add("imu", unbundled(Imu(config, bias, wiring.tick, samples)))
    wiring.builder.Connect(both.get_output_port(), imu.GetInputPort("integrals"))
    noise = add_noise(wiring, "imu_noise", 12, wiring.tick / samples, seed + 1)
    wiring.builder.Connect(noise, imu.GetInputPort("noise"))


def _add_encoders(
    wiring: Wiring, config: EncoderConfig, joints: np.ndarray, drawn: np.random.Generator, time: float
) -> None:
    """Rounded angles with what calibration leaves of their offsets, and rates by differences through a low-pass.

    d⁺ = a d + (1 − a)(q − q_last)/T with a = e^(−2π f T), counted from the posture at the start; T is `time` [s].
    """
    count, state = len(joints), wiring.port("joint_state")
    encoders = RotaryEncoders(state.size(), list(range(count)), [2**config.bits] * count)
    wiring.builder.AddNamedSystem("rotary_encoders", encoders)
    wiring.builder.Connect(state, encoders.get_input_port())
    offsets = config.left_offset * drawn.standard_normal(count)

    def set_offsets(root: Context) -> None:
        encoders.set_calibration_offsets(encoders.GetMyMutableContextFromRoot(root), offsets)

    wiring.adjust.append(set_offsets)
    one, none = np.eye(count), np.zeros((count, count))
    kept = math.exp(-2.0 * math.pi * config.cutoff * time)
    share = (1.0 - kept) / time
    rates = AffineSystem(
        A=np.block([[none, none], [-share * one, kept * one]]),
        B=np.vstack([one, share * one]),
        f0=np.concatenate([-joints, -share * joints]),
        C=np.block([[none, none], [-share * one, kept * one]]),
        D=np.vstack([one, share * one]),
        y0=np.concatenate([np.zeros(count), -share * joints]),
        time_period=time,
    )
    wiring.builder.AddNamedSystem("encoder_rates", rates)
    wiring.builder.Connect(encoders.get_output_port(), rates.get_input_port())
    wiring.offer("encoders", rates.get_output_port())


def _add_force_torque(
    wiring: Wiring, config: ForceTorqueConfig, plant: MultibodyPlant, biped: Biped, drawn: np.random.Generator,
    seed: int,
) -> None:  # fmt: skip
    """The reactions in the joints above the soles, their integrals at the plant's steps, and `ForceTorque`."""
    soles = wiring.builder.AddNamedSystem("sole_wrenches", SoleWrenches([_above(plant, side) for side in SIDES]))
    wiring.builder.Connect(plant.get_reaction_forces_output_port(), soles.get_input_port())
    integral = wiring.builder.AddNamedSystem("sole_wrench_integrals", DiscreteTimeIntegrator(12, plant.time_step()))
    wiring.builder.Connect(soles.get_output_port(), integral.get_input_port())
    offset = np.tile(np.repeat([config.torque_offset, config.force_offset], 3), 2) * drawn.standard_normal(12)
    sensors = wiring.add("force_torque", ForceTorque(config, offset, wiring.tick))
    wiring.builder.Connect(integral.get_output_port(), sensors.GetInputPort("integrals"))
    noise = add_noise(wiring, "force_torque_noise", 12, wiring.tick, seed + 2)
    wiring.builder.Connect(noise, sensors.GetInputPort("noise"))


def _above(plant: MultibodyPlant, side: Side) -> tuple[int, RigidTransform, float, np.ndarray]:
    """Of the moving joint above a sole what `SoleWrenches` needs."""
    sole, context = plant.GetFrameByName(sole_frame_name(side)), plant.CreateDefaultContext()
    foot = plant.GetBodiesWeldedTo(sole.body())
    joint = next(
        joint
        for joint in map(plant.get_joint, plant.GetJointIndices())
        if joint.num_velocities() and joint.child_body() in foot
    )
    place = sole.CalcPose(context, joint.frame_on_child())
    inertia = plant.CalcSpatialInertia(context, sole, [body.index() for body in foot])
    gravity = float(np.linalg.norm(plant.gravity_field().gravity_vector()))
    return int(joint.index()), place, inertia.get_mass() * gravity, inertia.get_com()
