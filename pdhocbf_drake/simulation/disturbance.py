"""Pushes, measurement errors and model errors of a scenario, made of Drake's own blocks.

A context holds parameters and seeds, so the functions that set them go into `Wiring.adjust`.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, SpatialInertia
from pydrake.systems.framework import Context
from pydrake.systems.primitives import Adder, DiscreteTimeDelay, MatrixGain, PassThrough

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.noise import add_noise
from pdhocbf_drake.simulation.scenario import MeasurementConfig, ModelErrorConfig, Scenario
from pdhocbf_drake.simulation.wiring import Wiring
from pdhocbf_drake.systems.push_schedule import TimedForce

_FOR_EVER = 2**52  # ticks


def timed_forces(scenario: Scenario, robot: tuple[MultibodyPlant, Biped] | None = None) -> list[TimedForce]:
    """The scenario's pushes and wind on the robot's bodies, or on the template's point mass where there is no robot.

    Raises:
        InputError: the robot has no such body.
    """
    forces = []
    for push in scenario.pushes:
        body, point = (BodyIndex(0), np.zeros(3)) if robot is None else _pushed_point(push.body, *robot)
        forces.append(TimedForce(body, point, np.array(push.force), *push.ticks(scenario.gait)))
    if any(scenario.wind):
        body, point = (BodyIndex(0), np.zeros(3)) if robot is None else _pushed_point(None, *robot)
        forces.append(TimedForce(body, point, np.array([*scenario.wind, 0.0]), 0, _FOR_EVER))
    return forces


def _pushed_point(name: str | None, plant: MultibodyPlant, biped: Biped) -> tuple[BodyIndex, np.ndarray]:
    """The body of that name, or the torso, and its centre of mass."""
    name = name or biped.torso_frame.body().name()
    if not plant.HasBodyNamed(name):
        robot = plant.get_body(plant.GetFloatingBaseBodies().pop()).model_instance()
        there = sorted(plant.get_body(index).name() for index in plant.GetBodyIndices(robot))
        raise InputError(f"pushes: the robot has no body '{name}'; it has {', '.join(there)}")
    body = plant.GetBodyByName(name)
    # Copies, since those of Drake keep the plant alive.
    return BodyIndex(int(body.index())), np.array(body.default_com())


def add_measurement(wiring: Wiring, config: MeasurementConfig, seed: int, **starts: np.ndarray) -> None:
    """Adds the delay of each named port, and the noise of `lip_state`, and logs it; nothing if it is exact.

    Args:
        starts: what each port measures before the start.
    """
    for name, start in starts.items() if config.late_ticks else ():
        port = wiring.port(name, measured=True)
        # The delay is updated at the instant at which the controller reads it, which is a delay of one tick itself.
        delay = DiscreteTimeDelay(wiring.tick, config.late_ticks - 1, port.size())
        wiring.builder.AddNamedSystem(f"{name}_delay", delay)
        wiring.builder.Connect(port, delay.get_input_port())
        wiring.offer(name, delay.get_output_port(), measured=True)
        wiring.adjust.append(partial(_fill, delay, start))
    deviations = np.array(config.noise.deviations)
    if deviations.any():
        _add_noise(wiring, deviations, seed)
    if config.delay_ticks or deviations.any():
        copied = wiring.builder.AddNamedSystem("measurement", PassThrough(deviations.size))
        wiring.builder.Connect(wiring.port("lip_state", measured=True), copied.get_input_port())
        wiring.offer("measured_state", copied.get_output_port())
        wiring.log("measured_state")


def _add_noise(wiring: Wiring, deviations: np.ndarray, seed: int) -> None:
    """Adds white noise to the measured `lip_state`."""
    noise = add_noise(wiring, "lip_state_noise", deviations.size, wiring.tick, seed)
    scale = wiring.builder.AddNamedSystem("lip_state_noise_scale", MatrixGain(np.diag(deviations)))
    noisy = wiring.builder.AddNamedSystem("lip_state_noisy", Adder(2, deviations.size))
    wiring.builder.Connect(noise, scale.get_input_port())
    wiring.builder.Connect(wiring.port("lip_state", measured=True), noisy.get_input_port(0))
    wiring.builder.Connect(scale.get_output_port(), noisy.get_input_port(1))
    wiring.offer("lip_state", noisy.get_output_port(), measured=True)


def _fill(delay: DiscreteTimeDelay, start: np.ndarray, root: Context) -> None:
    """What a delay gives out before anything has passed through it."""
    state = delay.GetMyMutableContextFromRoot(root).get_mutable_discrete_state_vector()
    state.SetFromVector(np.tile(start, state.size() // len(start)))


def add_model_error(wiring: Wiring, config: ModelErrorConfig, plant: MultibodyPlant, biped: Biped) -> None:
    """Scales the mass of the simulated torso and shifts its CoM; those of the controller's model stay."""
    if config.torso_mass == 1.0 and not any(config.com_shift):
        return
    torso = biped.torso_frame.body()
    # A spatial inertia is mass, centre and unit inertia: a scaled mass scales the rotational inertia with it.
    mass, place = config.torso_mass * torso.default_mass(), torso.default_com()
    about_com = torso.default_spatial_inertia().Shift(place).CalcRotationalInertia() * config.torso_mass
    whole = biped.mass + mass - torso.default_mass()
    ahead = biped.torso_frame.GetFixedPoseInBodyFrame().rotation()
    shifted = place + ahead @ np.array(config.com_shift) * (whole / mass)
    inertia = SpatialInertia.MakeFromCentralInertia(mass, shifted, about_com)

    def load(root: Context) -> None:
        context = plant.GetMyMutableContextFromRoot(root)
        plant.GetBodyByName(torso.name()).SetSpatialInertiaInBodyFrame(context, inertia)

    wiring.adjust.append(load)


def tilted_gravity(config: ModelErrorConfig, gravity: np.ndarray) -> np.ndarray:
    """A vertical gravity (3,) tilted as a model error says [m/s²]."""
    x, y = np.sin(np.deg2rad(config.gravity_tilt_deg))
    return float(np.linalg.norm(gravity)) * np.array([x, y, -math.sqrt(1.0 - x * x - y * y)])
