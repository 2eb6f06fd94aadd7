"""Pushes, measurement errors and model errors of a scenario, made of Drake's own blocks.

A context holds parameters and seeds, so the functions that set them go into `Wiring.adjust`.
"""

from __future__ import annotations

import numpy as np
from pydrake.common import RandomDistribution, RandomGenerator
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import Context
from pydrake.systems.primitives import Adder, DiscreteTimeDelay, MatrixGain, RandomSource

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.scenario import MeasurementConfig, ModelErrorConfig, Push, Scenario
from pdhocbf_drake.simulation.wiring import Wiring
from pdhocbf_drake.systems.push_schedule import TimedForce


def timed_forces(scenario: Scenario, robot: tuple[MultibodyPlant, Biped] | None = None) -> list[TimedForce]:
    """The scenario's pushes on the robot's bodies, or on the template's point mass where there is no robot.

    Raises:
        InputError: the robot has no such body.
    """
    forces = []
    for push in scenario.pushes:
        body, point = (BodyIndex(0), np.zeros(3)) if robot is None else _pushed_point(push, *robot)
        first = round(push.start(scenario.gait) / scenario.gait.tick)
        last = first + max(1, round(push.duration / scenario.gait.tick))
        forces.append(TimedForce(body, point, np.array(push.force), first, last))
    return forces


def _pushed_point(push: Push, plant: MultibodyPlant, biped: Biped) -> tuple[BodyIndex, np.ndarray]:
    """The pushed body and its centre of mass."""
    name = push.body or biped.config.torso_link or biped.config.base_link
    if not plant.HasBodyNamed(name):
        robot = plant.get_body(plant.GetFloatingBaseBodies().pop()).model_instance()
        there = sorted(plant.get_body(index).name() for index in plant.GetBodyIndices(robot))
        raise InputError(f"pushes: the robot has no body '{name}'; it has {', '.join(there)}")
    body = plant.GetBodyByName(name)
    # Copies, since those of Drake keep the plant alive.
    return BodyIndex(int(body.index())), np.array(body.default_com())


def add_measurement(wiring: Wiring, config: MeasurementConfig, seed: int, *names: str) -> None:
    """Adds the delay of each named port, and the noise of `lip_state`; nothing for an exact measurement."""
    for name in names if config.delay_ticks else ():
        port = wiring.port(name)
        # The delay is updated at the instant at which the controller reads it, which is a delay of one tick itself.
        delay = DiscreteTimeDelay(wiring.tick, config.delay_ticks - 1, port.size())
        wiring.builder.AddNamedSystem(f"{name}_delay", delay)
        wiring.builder.Connect(port, delay.get_input_port())
        wiring.offer(name, delay.get_output_port(), measured=True)
    deviations = np.array(config.noise.deviations)
    if not deviations.any():
        return
    source = RandomSource(RandomDistribution.kGaussian, deviations.size, wiring.tick)
    wiring.builder.AddNamedSystem("lip_state_noise", source)
    scale = wiring.builder.AddNamedSystem("lip_state_noise_scale", MatrixGain(np.diag(deviations)))
    noisy = wiring.builder.AddNamedSystem("lip_state_noisy", Adder(2, deviations.size))
    wiring.builder.Connect(source.get_output_port(), scale.get_input_port())
    wiring.builder.Connect(wiring.port("lip_state", measured=True), noisy.get_input_port(0))
    wiring.builder.Connect(scale.get_output_port(), noisy.get_input_port(1))
    wiring.offer("lip_state", noisy.get_output_port(), measured=True)

    def seed_source(root: Context) -> None:
        source.SetRandomContext(source.GetMyMutableContextFromRoot(root), RandomGenerator(seed))

    wiring.adjust.append(seed_source)


def add_model_error(wiring: Wiring, config: ModelErrorConfig, plant: MultibodyPlant, biped: Biped) -> None:
    """Scales the mass of the simulated torso; that of the controller's model stays."""
    if config == ModelErrorConfig():
        return
    body = plant.GetBodyByName(biped.config.torso_link or biped.config.base_link)

    def scale_mass(root: Context) -> None:
        context = plant.GetMyMutableContextFromRoot(root)
        # A spatial inertia is mass, centre and unit inertia: a scaled mass scales the rotational inertia with it.
        body.SetMass(context, config.torso_mass * body.default_mass())

    wiring.adjust.append(scale_mass)
