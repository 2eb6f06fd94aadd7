"""Inverse dynamics: the equations of motion hold, in an independent form and in the plant itself."""

from __future__ import annotations

import numpy as np
import pytest
from biped_cases import biped, ik, random_posture, standing
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.multibody.tree import JacobianWrtVariable

from pdhocbf_drake.robot import InverseDynamics, WholeBodyIk, left_share_of_zmp
from pdhocbf_drake.robot.posture import COM, LEFT, RIGHT


def random_motion(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    q = ik().solve(random_posture(rng), biped().bent_knee).q
    return q, rng.normal(size=18), 5 * rng.normal(size=18)


def test_a_motion_in_one_call_is_that_of_its_steps_and_leaves_the_same_behind() -> None:
    """To the last bit, with targets that can't be met, and rates that can't be followed, in between."""
    once, steps = (WholeBodyIk(biped()) for _ in range(2))
    dynamics, other = InverseDynamics(biped(), once.task_space), InverseDynamics(biped(), steps.task_space)
    rng, met = np.random.default_rng(3), []
    for number in range(60):
        posture, share = random_posture(rng), rng.uniform()
        seed = ik().solve(posture, biped().bent_knee).q
        seed[biped().q_index] += 0.02 * rng.normal(size=12)
        wanted = np.array([np.zeros(18), 0.3 * rng.normal(size=18), rng.normal(size=18)])
        wanted[0, COM], wanted[0, LEFT], wanted[0, RIGHT] = posture.com, posture.left[:3], posture.right[:3]
        angles = (*posture.torso_rpy.tolist(), *posture.left[3:].tolist(), *posture.right[3:].tolist())
        if number % 6 == 1:
            wanted[0, COM.start + 2] += 0.4  # out of reach
        if number % 6 == 2:
            wanted[1] *= np.nan if number % 12 == 2 else 1e5
        if number % 6 == 3:
            seed[biped().q_index[3]] = biped().position_limits[3, 1] + 0.1
        (*motion, found), torque = dynamics.along(once, wanted, seed, share, None, angles)
        expected = steps.motion(wanted, seed, None, angles)
        theirs = other(*expected[:3], share)
        met.append(found.ok)
        assert found[1:] == expected.ik[1:]
        for one, two in zip((*motion, found.q, *torque), (*expected[:3], expected.ik.q, *theirs), strict=True):
            np.testing.assert_array_equal(one, two)
        left, right = once.task_space, steps.task_space
        for name in ("poses", "jacobian", "bias", "com_velocity"):
            np.testing.assert_array_equal(getattr(left, name)(), getattr(right, name)(), err_msg=name)
        np.testing.assert_array_equal(left.solve(wanted[2]), right.solve(wanted[2]))
    assert 20 < sum(met) < 60


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("seed", range(5))
def test_equations_of_motion_hold_in_every_row(seed: int, share: float) -> None:
    q, v, vdot = random_motion(seed)
    torques, left, right = InverseDynamics(biped())(q, v, vdot, share)
    plant, context = biped().plant, biped().plant.CreateDefaultContext()
    plant.SetPositions(context, q)
    plant.SetVelocities(context, v)
    balance = plant.CalcMassMatrix(context) @ vdot + plant.CalcBiasTerm(context)
    balance -= plant.CalcGravityGeneralizedForces(context)
    balance[biped().v_index] -= torques
    for side, wrench in (("left", left), ("right", right)):
        jacobian = plant.CalcJacobianSpatialVelocity(
            context, JacobianWrtVariable.kV, biped().soles[side].frame, np.zeros(3),
            plant.world_frame(), plant.world_frame(),
        )  # fmt: skip
        balance -= jacobian.T @ np.concatenate([wrench[3:], wrench[:3]])
    np.testing.assert_allclose(balance, 0.0, atol=1e-9)


def test_the_plant_accelerates_as_planned_under_these_torques_and_wrenches() -> None:
    q, v, vdot = random_motion(7)
    torques, *wrenches = InverseDynamics(biped())(q, v, vdot, 0.4)
    plant, context = biped().plant, biped().plant.CreateDefaultContext()
    plant.SetPositions(context, q)
    plant.SetVelocities(context, v)
    actuation = np.zeros(12)
    actuation[biped().u_index] = torques
    plant.get_actuation_input_port().FixValue(context, actuation)
    pushes = []
    for side, wrench in zip(("left", "right"), wrenches, strict=True):
        push = ExternallyAppliedSpatialForce()
        frame = biped().soles[side].frame
        push.body_index = frame.body().index()
        push.p_BoBq_B = frame.GetFixedPoseInBodyFrame().translation()
        push.F_Bq_W = SpatialForce(tau=wrench[3:], f=wrench[:3])
        pushes.append(push)
    plant.get_applied_spatial_force_input_port().FixValue(context, Value[list[ExternallyAppliedSpatialForce]](pushes))
    np.testing.assert_allclose(plant.get_generalized_acceleration_output_port().Eval(context), vdot, atol=1e-8)


def test_standing_the_ground_carries_the_weight_under_the_com() -> None:
    q = ik().solve(standing(), biped().bent_knee).q
    _, left, right = InverseDynamics(biped())(q, np.zeros(18), np.zeros(18), 0.5)
    np.testing.assert_allclose(left[:3] + right[:3], [0, 0, 9.81 * biped().mass], atol=1e-9)
    np.testing.assert_allclose(left, right, atol=1e-9)
    np.testing.assert_allclose(left[3:], 0.0, atol=1e-6)  # the CoM is above the middle of the soles


@pytest.mark.parametrize("lateral", [-0.08, -0.05, 0.0, 0.03, 0.08])
def test_share_of_the_zmp_keeps_each_centre_of_pressure_inside_its_sole(lateral: float) -> None:
    target = standing()._replace(com=np.array([0.04, lateral, 0.58]))
    q = ik().solve(target, biped().bent_knee).q
    share = left_share_of_zmp(target.com[:2], target.left[:2], target.right[:2])
    assert share == pytest.approx((lateral + 0.08) / 0.16)
    for wrench in InverseDynamics(biped())(q, np.zeros(18), np.zeros(18), share)[1:]:
        if wrench[2] > 1.0:
            np.testing.assert_allclose([-wrench[4], wrench[3]] / wrench[2], [0.02, 0.0], atol=1e-6)


def test_share_is_clipped_beyond_the_feet() -> None:
    left, right = np.array([0.0, 0.1]), np.array([0.0, -0.1])
    assert left_share_of_zmp(np.array([0.0, 0.3]), left, right) == 1.0
    assert left_share_of_zmp(np.array([0.0, -0.3]), left, right) == 0.0


def test_sharing_the_kinematics_of_the_ik_changes_nothing() -> None:
    q, v, vdot = random_motion(3)
    shared = InverseDynamics(biped(), ik().task_space)(q, v, vdot, 0.6)
    ik().solve(standing(0.5), biped().bent_knee)
    again = InverseDynamics(biped(), ik().task_space)(q, v, vdot, 0.6)
    for alone, first, second in zip(InverseDynamics(biped())(q, v, vdot, 0.6), shared, again, strict=True):
        np.testing.assert_array_equal(first, alone)
        np.testing.assert_array_equal(second, alone)


def test_the_wrenches_act_at_the_centres_of_the_soles() -> None:
    q = ik().solve(standing(), biped().bent_knee).q
    context = biped().plant.CreateDefaultContext()
    biped().plant.SetPositions(context, q)
    pose: RigidTransform = biped().soles["left"].frame.CalcPoseInWorld(context)
    assert pose.IsNearlyEqualTo(RigidTransform([0.02, 0.08, 0.0]), 1e-7)
