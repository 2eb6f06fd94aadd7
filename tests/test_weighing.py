"""A robot that is weighed: weight and CoM of the controller's model are those of the robot that stands."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.multibody.tree import SpatialInertia

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.robot.drake_task_space import DrakeTaskSpace
from pdhocbf_drake.robot.tree_task_space import task_space_of
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.weighing import Stand, stand, weighed

BIPED = Biped.load("biped")
Q = BIPED.bent_knee


def loaded(factor: float, shift: np.ndarray) -> Biped:
    """The robot with a torso of another mass, its CoM shifted [m]."""
    torso = BIPED.torso_frame.body()
    own = torso.default_spatial_inertia()
    about = own.Shift(own.get_com()).CalcRotationalInertia() * factor
    return BIPED.with_torso(
        SpatialInertia.MakeFromCentralInertia(factor * own.get_mass(), own.get_com() + shift, about)
    )


def com(biped: Biped) -> np.ndarray:
    task = task_space_of(biped)
    task.set_positions(Q)
    return task.poses()[:3].copy()


def test_a_load_is_found_again_from_its_weight_and_zmp() -> None:
    real = loaded(1.3, np.array([0.03, -0.02, 0.0]))
    known = weighed(BIPED, Stand(real.weight, com(real)[:2], Q))
    assert known.mass == pytest.approx(real.mass)
    np.testing.assert_allclose(com(known), com(real), atol=1e-12)
    again = weighed(known, Stand(real.weight, com(real)[:2], Q))  # a robot that is known already stays as it is
    assert again.mass == pytest.approx(real.mass)
    np.testing.assert_allclose(com(again), com(real), atol=1e-12)


def test_kernels_and_drake_agree_on_a_loaded_robot() -> None:
    real, rng = loaded(0.8, np.array([0.01, 0.02, 0.0])), np.random.default_rng(0)
    fast, slow = task_space_of(real), DrakeTaskSpace(real)
    v, vdot = rng.normal(size=(2, 18))
    for task in (fast, slow):
        task.set_positions(Q)
        task.set_state(Q, v)
    np.testing.assert_allclose(fast.poses(), slow.poses(), atol=1e-12)
    np.testing.assert_allclose(fast.com_velocity(), slow.com_velocity(), atol=1e-12)
    np.testing.assert_allclose(fast.forces(vdot), slow.forces(vdot), atol=1e-9)


def test_a_stand_of_a_heavy_robot_weighs_it_and_leaves_the_one_of_the_file() -> None:
    text = "model_error: {torso_mass: 1.3, com_shift: [0.0, 0.01, 0.0], gravity_tilt_deg: [2, 0]}"
    scenario, before = load_scenario("walking", text), BIPED.mass
    seen = stand(scenario, build_walk(scenario), BIPED)
    torso = BIPED.torso_frame.body().default_mass()
    known = weighed(BIPED, seen)
    assert known.mass == pytest.approx(BIPED.mass + 0.3 * torso, rel=2e-3)
    assert com(known)[1] - com(BIPED)[1] == pytest.approx(0.01, abs=2e-3)
    assert BIPED.mass == before


@pytest.mark.parametrize(
    ("load", "zmp", "message"),
    [
        (10.0, 0.0, "biped.weigh: the robot does not stand, the ground carries 10 N of 284"),
        (284.0, np.nan, "biped.weigh: the robot does not stand, the ground carries 284 N of 284"),
        (130.0, 0.0, "biped.weigh: the robot weighs 13.3 kg, which leaves its torso"),
    ],
)
def test_a_stand_that_weighs_nothing_is_refused(load: float, zmp: float, message: str) -> None:
    with pytest.raises(InputError) as error:
        weighed(BIPED, Stand(load, np.full(2, zmp), Q))
    assert str(error.value).startswith(message)
