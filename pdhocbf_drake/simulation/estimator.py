"""The estimator between the sensors and the controller."""

from __future__ import annotations

from pdhocbf_drake.estimation.anchor import AnchorFilter
from pdhocbf_drake.estimation.config import SensorsConfig
from pdhocbf_drake.estimation.contact_ekf import ContactEkf
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.wiring import Wiring
from pdhocbf_drake.systems.base_estimator import BaseEstimator, EstimateErrors, TrueState
from pdhocbf_drake.systems.unbundled import unbundled
from pdhocbf_drake.walking.footsteps import Footstep

_GIVEN = {"lip_state": "lip_estimate", "foot_state": "foot_estimate"}


def add_estimator(wiring: Wiring, config: SensorsConfig, biped: Biped, start: Footstep) -> None:
    """Gives the controller what is estimated from the sensors in place of the true state.

    Args:
        start: where the robot stands at tick 0, which no sensor can say.
    """
    kind = ContactEkf if config.estimator.kind == "ekf" else AnchorFilter
    estimator_block = BaseEstimator(kind(biped, config, wiring.tick, (start.x, start.y, start.yaw)), wiring.tick)
    estimator = wiring.add("base_estimator", unbundled(estimator_block))
    wiring.connect(estimator, "imu", "encoders", "force_torque")
    for name, estimate in _GIVEN.items():
        wiring.offer(name, wiring.port(estimate), measured=True)
    velocity = biped.plant.num_positions() + biped.base_v_index[3:]
    errors = wiring.add("estimate_errors", EstimateErrors(biped.base_q_index, velocity))
    wiring.connect(errors, "estimator_memory", "robot_state", "foot_state")
    truth = wiring.add("true_state", TrueState())
    wiring.connect(truth, "lip_state", "foot_state", "foot_estimate", "estimator_status")


def connect_estimator(wiring: Wiring) -> None:
    """Connects what stands in for sensors that fail, and logs sensors and estimate."""
    estimator = wiring.port("lip_estimate").get_system()
    wiring.connect(estimator, "desired_state", "gait_phase")
    wiring.log("imu", "encoders", "force_torque", *_GIVEN.values(), "com_z_estimate", "estimate_deviation")
    wiring.log("estimator_status", "base_estimate", "estimate_error")
