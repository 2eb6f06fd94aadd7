"""Drives that read the encoders once a tick: gains with which a joint comes to rest, and a walk on them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.biped_plant import standing_posture
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.simulation.drives import sampled_gains
from pdhocbf_drake.simulation.run_log import FINISHED
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate

CUTOFF, STEP = 40.0, 0.001  # of the encoders' rates [Hz], and of the plant [s]


@pytest.fixture(scope="module")
def biped() -> Biped:
    return Biped.load("biped")


@pytest.fixture(scope="module")
def posture(biped: Biped) -> np.ndarray:
    return standing_posture(build_walk(load_scenario("walking_nobarrier")), biped)


def growth(biped: Biped, posture: np.ndarray, tick: float, kp: np.ndarray, kd: np.ndarray) -> float:
    """How much the joints' motion on a robot in the air may grow in a tick: the loop's spectral radius.

    Angles and rates q, v, the last angle that was read, the low-pass of the rate, and the torque that is held, which
    acts a step after the encoders are read.
    """
    context = biped.context()
    biped.plant.SetPositions(context, posture)
    mobility = np.linalg.inv(biped.plant.CalcMassMatrix(context))[np.ix_(biped.v_index, biped.v_index)]
    kept = math.exp(-2.0 * math.pi * CUTOFF * STEP)
    q, v, last, rate, torque = np.eye(60).reshape(5, 12, 60)
    for step in range(round(tick / STEP)):
        rate = kept * rate + (1.0 - kept) / STEP * (q - last)
        asked = -kp[:, None] * q - kd[:, None] * rate if step == 0 else torque
        last = q
        v = v + STEP * mobility @ torque
        q = q + STEP * v
        torque = asked
    return float(np.abs(np.linalg.eigvals(np.vstack([q, v, last, rate, torque]))).max())


@pytest.mark.parametrize("tick", [0.001, 0.002, 0.005, 0.01, 0.02])
def test_a_leg_in_the_air_comes_to_rest_at_any_tick(biped: Biped, posture: np.ndarray, tick: float) -> None:
    kp, kd = sampled_gains(biped, posture, tick + STEP + 1.0 / (2.0 * math.pi * CUTOFF))
    assert np.all((kp <= biped.kp) & (kd <= biped.kd))
    assert growth(biped, posture, tick, kp, kd) < 1.0


def test_with_the_robots_own_gains_it_would_not(biped: Biped, posture: np.ndarray) -> None:
    assert growth(biped, posture, 0.01, biped.kp, biped.kd) > 1.0
    kp, kd = sampled_gains(biped, posture, 1e-5)
    assert np.array_equal(kp, biped.kp)
    assert np.array_equal(kd, biped.kd)


def test_the_robot_walks_on_sampled_drives() -> None:
    log = simulate(load_scenario("walking_sensors", "{duration: 2.4, measurement: {drives: sampled}}"))
    assert log.ending == FINISHED
    x = log.element("lip_state", "x")
    assert (x[-1] - x[-41]) / 0.4 == pytest.approx(0.375, abs=0.02)
    assert np.abs(log["desired_state"][1:, :12] - log["joint_state"][1:, :12]).max() > 0.01  # softer than its own PD


@pytest.mark.parametrize(
    ("name", "measurement", "says"),
    [
        ("walking", "{drives: sampled}", "measurement.drives: sampled needs measurement.source: sensors"),
        (
            "walking_sensors",
            "{drives: sampled, faults: [{time: 1.0, sensor: left_knee_pitch, kind: stuck}]}",
            "measurement.faults.0.sensor: an encoder can't fail where measurement.drives is sampled",
        ),
    ],
)
def test_drives_without_encoders_are_refused(name: str, measurement: str, says: str) -> None:
    with pytest.raises(InputError) as error:
        simulate(load_scenario(name, f"measurement: {measurement}"))
    assert str(error.value).startswith(says)
