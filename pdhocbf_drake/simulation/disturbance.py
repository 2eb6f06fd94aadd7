"""Disturbs what the controller sees and what the plant weighs, with Drake's own blocks.

Parameters and seeds live in a context, so each function that changes one returns what to do to the context.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pydrake.common import RandomDistribution, RandomGenerator
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context
from pydrake.systems.primitives import Adder, DiscreteTimeDelay, MatrixGain, RandomSource

from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.disturbance_config import MeasurementConfig, ModelErrorConfig

if TYPE_CHECKING:
    from pdhocbf_drake.simulation.diagram import Wiring

SEEN = "_seen"  # what the controller is told of a port, where that is not the port itself


def add_measurement(wiring: Wiring, config: MeasurementConfig, seed: int, *names: str) -> None:
    """Offers NAME_seen for each named port: late by the delay, and with the noise where it is `lip_state`.

    Nothing is added for a perfect measurement, so that its log stays what it was.
    """
    if config == MeasurementConfig():
        return
    for name in names:
        port = wiring.port(name)
        if config.delay_ticks:
            # Its memory is renewed at the instant at which the controller reads it, which costs one tick of itself.
            delay = DiscreteTimeDelay(wiring.tick, config.delay_ticks - 1, port.size())
            wiring.builder.AddNamedSystem(f"{name}_delay", delay)
            wiring.builder.Connect(port, delay.get_input_port())
            port = delay.get_output_port()
        wiring.offer(name + SEEN, port)
    deviations = np.array(config.noise.deviations)
    if not deviations.any():
        return
    source = RandomSource(RandomDistribution.kGaussian, deviations.size, wiring.tick)
    wiring.builder.AddNamedSystem("lip_state_noise", source)
    scale = wiring.builder.AddNamedSystem("lip_state_noise_scale", MatrixGain(np.diag(deviations)))
    noisy = wiring.builder.AddNamedSystem("lip_state_noisy", Adder(2, deviations.size))
    wiring.builder.Connect(source.get_output_port(), scale.get_input_port())
    wiring.builder.Connect(wiring.port("lip_state" + SEEN), noisy.get_input_port(0))
    wiring.builder.Connect(scale.get_output_port(), noisy.get_input_port(1))
    wiring.offer("lip_state" + SEEN, noisy.get_output_port())

    def seed_source(root: Context) -> None:
        source.SetRandomContext(source.GetMyMutableContextFromRoot(root), RandomGenerator(seed))

    wiring.adjust.append(seed_source)


def add_model_error(wiring: Wiring, config: ModelErrorConfig, plant: MultibodyPlant, biped: Biped) -> None:
    """Makes the simulated torso heavier or lighter than the controller's."""
    if config == ModelErrorConfig():
        return
    body = plant.GetBodyByName(biped.config.torso_link or biped.config.base_link)

    def scale_mass(root: Context) -> None:
        context = plant.GetMyMutableContextFromRoot(root)
        # A spatial inertia is mass, centre and unit inertia: a scaled mass scales the rotational inertia with it.
        body.SetMass(context, config.torso_mass * body.default_mass())

    wiring.adjust.append(scale_mass)
