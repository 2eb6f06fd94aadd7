"""The blocks of the robot: inverse kinematics, estimator, joint targets and joint PD, each in a context of its own."""

import numpy as np
import pytest
from contexts import update
from pydrake.math import RollPitchYaw
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, DiagramBuilder

from pdhocbf_drake.robot import Biped, InverseDynamics, sole_pose, upright_posture
from pdhocbf_drake.simulation.biped_plant import add_robot, model_instance
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.systems.inverse_kinematics import InverseKinematics
from pdhocbf_drake.systems.joint_targets import joint_targets
from pdhocbf_drake.systems.kernels import write_step
from pdhocbf_drake.systems.state_estimator import StateEstimator, last_zmp
from pdhocbf_drake.systems.unbundled import unbundled
from pdhocbf_drake.walking import Gait, GaitConfig

GAIT = Gait(GaitConfig())
FEET = np.array([[0.0, 0.08], [0.0, -0.08]])


@pytest.fixture(scope="module")
def biped() -> Biped:
    return Biped.load("biped")


@pytest.fixture(scope="module")
def posture(biped: Biped) -> np.ndarray:
    return upright_posture(biped, np.array([0.0, 0.0, 0.58]), sole_pose(0.0, 0.08), sole_pose(0.0, -0.08))


def test_kinematics_meets_the_plan_and_its_rates_lead_there(biped: Biped, posture: np.ndarray) -> None:
    block = unbundled(InverseKinematics(biped, posture, 0.01))
    context = block.CreateDefaultContext()
    com = np.array([0.01, 0.1, 0.0, -0.005, 0.05, 0.0])
    feet = np.zeros((2, 3, 3))
    feet[0, 0], feet[1, 0] = [0.0, 0.08, 0.0], [0.0, -0.08, 0.0]
    for name, value in (
        ("com_height", [0.58, 0.0, 0.0]), ("com_reference", com), ("zmp_reference", [0.01, 0, -0.005, 0]),
        ("foot_reference", feet.ravel()),
    ):  # fmt: skip
        block.GetInputPort(name).FixValue(context, value)
    desired = block.GetOutputPort("desired_state").Eval(context)
    assert block.GetOutputPort("ik_status").Eval(context)[0] == 1.0
    np.testing.assert_allclose(posture[biped.q_index] + 0.01 * desired[12:], desired[:12])
    # With no acceleration the whole body's ZMP lies under its CoM.
    np.testing.assert_allclose(block.GetOutputPort("whole_body_zmp").Eval(context), [0.01, -0.005], atol=2e-3)
    torque = block.GetOutputPort("feedforward").Eval(context)
    assert np.all(np.abs(torque) < biped.effort_limits)


def _kinematics(biped: Biped, posture: np.ndarray, **given: object) -> tuple[Diagram, Context]:
    """The block before its first tick, standing still over both feet but for what is given."""
    block = unbundled(InverseKinematics(biped, posture, 0.01))
    context = block.CreateDefaultContext()
    still = {"com_height": [0.58, 0.0, 0.0], "com_reference": np.zeros(6), "zmp_reference": np.zeros(4)}
    for name, value in (still | given).items():
        block.GetInputPort(name).FixValue(context, np.ravel(value))
    return block, context


def _at(biped: Biped, q: np.ndarray) -> Context:
    """A context of the robot alone, in the posture q (19,)."""
    context = biped.plant.CreateDefaultContext()
    biped.plant.SetPositions(context, q)
    return context


def _at_rest(left: list[float], right: list[float]) -> np.ndarray:
    """A foot_reference of two soles that don't move."""
    return np.array([[left, [0.0] * 3, [0.0] * 3], [right, [0.0] * 3, [0.0] * 3]])


@pytest.mark.parametrize(
    ("lift", "zmp", "share"),
    [((0.0, 0.0), 0.04, 0.75), ((0.0, 0.0), -0.04, 0.25), ((0.02, 0.0), 0.04, 0.0), ((0.0, 0.02), -0.04, 1.0)],
)
def test_the_zmp_determines_the_load_of_each_foot_and_a_lifted_one_carries_nothing(
    biped: Biped, posture: np.ndarray, lift: tuple[float, float], zmp: float, share: float
) -> None:
    feet = _at_rest([0.05, 0.08, lift[0]], [0.05, -0.08, lift[1]])
    wanted = {"com_reference": [0.01, 0, 0, 0, 0, 0], "zmp_reference": [0.05, 0.0, zmp, 0.0], "foot_reference": feet}
    block, context = _kinematics(biped, posture, **wanted)
    torque = block.GetOutputPort("feedforward").Eval(context)
    # Nothing moves, so that the ZMP is under the CoM whoever carries how much.
    np.testing.assert_allclose(block.GetOutputPort("whole_body_zmp").Eval(context), [0.01, 0.0], atol=1e-6)
    update(block, context)
    q, v, vdot = np.split(context.get_discrete_state_vector().value()[:55], [19, 37])
    np.testing.assert_allclose(torque, InverseDynamics(biped)(q, v, vdot, share).tau, atol=1e-9)


def test_kinematics_starts_where_the_last_motion_leads(biped: Biped, posture: np.ndarray) -> None:
    """A motion that continues takes fewer iterations with v and v̇ in the state than without them."""
    feet = _at_rest([0.0, 0.08, 0.0], [0.0, -0.08, 0.0])
    block, context = _kinematics(biped, posture, com_reference=[0, 0.5, 3.0, 0, 0, 0], foot_reference=feet)
    update(block, context)
    moving = context.get_discrete_state_vector().value().copy()
    moving[55:73] = moving[37:55]  # v̇ has been the same for two ticks
    onward = [0.01 * 0.5 + 0.5 * 0.01**2 * 3.0, 0.53, 3.0, 0, 0, 0]
    block.GetInputPort("com_reference").FixValue(context, onward)
    iterations = []
    for kept in (37 + 36, 37, 19):  # all, without the accelerations, without the velocity
        context.SetDiscreteState(np.where(np.arange(75) < kept, moving, 0.0))
        iterations.append(block.GetOutputPort("ik_status").Eval(context)[2])
    assert iterations[0] < min(iterations[1:])


def test_kinematics_goes_on_as_its_acceleration_changed_last(biped: Biped, posture: np.ndarray) -> None:
    """Exact on a cubic: v̇ of this tick and of the one before give the third derivative."""
    tick, now = 0.01, 0.3
    v, vdot, before = (np.full(18, value) for value in (3.0 * now**2, 6.0 * now, 6.0 * (now - tick)))
    way = np.empty(18)
    write_step(np.concatenate([np.zeros(19), v, vdot, before]), tick, way)
    np.testing.assert_allclose(way, (now + tick) ** 3 - now**3, rtol=1e-9)

    feet = _at_rest([0.0, 0.08, 0.0], [0.0, -0.08, 0.0])
    block, context = _kinematics(biped, posture, com_reference=[0, 0.5, 3.0, 0, 0, 0], foot_reference=feet)
    update(block, context)
    first = context.get_discrete_state_vector().value().copy()
    update(block, context)
    second = context.get_discrete_state_vector().value()
    np.testing.assert_array_equal(second[55:73], first[37:55])
    assert np.abs(first[37:55]).max() > 1.0


@pytest.mark.parametrize("support", [1.0, -1.0])
def test_with_a_plan_out_of_reach_the_stance_foot_still_meets_its_target(
    biped: Biped, posture: np.ndarray, support: float
) -> None:
    soles = [[0.0, 0.08, 0.0], [0.0, -0.08, 0.0]]
    standing = 0 if support > 0 else 1
    soles[1 - standing][0] = 0.9
    block, context = _kinematics(biped, posture, foot_reference=_at_rest(*soles), gait_phase=[20.0, 3.0, support])
    assert block.GetOutputPort("ik_status").Eval(context)[0] == 0.0
    update(block, context)
    reached = _at(biped, context.get_discrete_state_vector().value()[:19])
    found = [biped.soles[side].frame.CalcPoseInWorld(reached).translation() for side in ("left", "right")]
    missed = np.linalg.norm(np.array(found) - soles, axis=1)
    assert missed[standing] < 1e-3
    assert missed[1 - standing] > 0.1


def test_a_robot_that_is_raised_has_its_zmp_moved_along_the_ground_reaction(biped: Biped, posture: np.ndarray) -> None:
    """The ZMP is a point of the ground at z = 0: it moves by −Δz (ẍ, ÿ)/(g + z̈), wherever the soles are."""
    zmp, com = [], [0.0, 0.0, 1.2, 0.0, 0.0, -0.8]
    for raised in (0.0, 0.03):
        feet, height = _at_rest([0.0, 0.08, raised], [0.0, -0.08, raised]), [0.58 + raised, 0.0, 0.5]
        block, context = _kinematics(biped, posture, com_height=height, com_reference=com, foot_reference=feet)
        zmp.append(block.GetOutputPort("whole_body_zmp").Eval(context))
        assert block.GetOutputPort("ik_status").Eval(context)[0] == 1.0
    np.testing.assert_allclose(zmp[1] - zmp[0], -0.03 / (9.81 + 0.5) * np.array([1.2, -0.8]), atol=1e-7)


def test_an_unreachable_plan_gives_finite_targets_and_a_status(biped: Biped, posture: np.ndarray) -> None:
    block = unbundled(InverseKinematics(biped, posture, 0.01))
    context = block.CreateDefaultContext()
    feet = np.zeros((2, 3, 3))
    feet[0, 0], feet[1, 0] = [0.9, 0.08, 0.0], [0.0, -0.08, 0.0]
    for name, value in (
        ("com_height", [0.58, 0.0, 0.0]), ("com_reference", np.zeros(6)), ("zmp_reference", np.zeros(4)),
        ("foot_reference", feet.ravel()),
    ):  # fmt: skip
        block.GetInputPort(name).FixValue(context, value)
    assert block.GetOutputPort("ik_status").Eval(context)[0] == 0.0
    assert np.all(np.isfinite(block.GetOutputPort("desired_state").Eval(context)))


def test_the_soles_angles_are_those_of_drake_for_any_orientation_of_the_robot(
    biped: Biped, posture: np.ndarray
) -> None:
    estimator = unbundled(StateEstimator(biped))
    context = estimator.CreateDefaultContext()
    estimator.GetInputPort("contact_forces").FixValue(context, np.zeros(18))
    for turn in np.random.default_rng(0).normal(size=(20, 4)):
        q = posture.copy()
        q[biped.base_q_index[:4]] = turn / np.linalg.norm(turn)
        estimator.GetInputPort("robot_state").FixValue(context, np.concatenate([q, np.zeros(18)]))
        here = _at(biped, q)
        poses = [biped.soles[side].frame.CalcPoseInWorld(here) for side in ("left", "right")]
        expected = [[*pose.translation(), *RollPitchYaw(pose.rotation()).vector()] for pose in poses]
        estimate = estimator.GetOutputPort("foot_state").Eval(context)
        np.testing.assert_allclose(estimate, np.ravel(expected), atol=1e-12)


def test_estimator_finds_com_soles_and_zmp(biped: Biped, posture: np.ndarray) -> None:
    estimator = unbundled(StateEstimator(biped))
    context = estimator.CreateDefaultContext()
    estimator.GetInputPort("robot_state").FixValue(context, np.concatenate([posture, np.zeros(18)]))
    base = posture[biped.base_q_index[4:]]
    point, force = np.array([0.03, -0.02, 0.0]), np.array([11.0, -7.0, 280.0])
    wrench = np.zeros(18)
    wrench[biped.base_v_index] = np.concatenate([np.cross(point - base, force), force])
    estimator.GetInputPort("contact_forces").FixValue(context, wrench)
    lip = estimator.GetOutputPort("lip_state").Eval(context)
    np.testing.assert_allclose(lip, [0.0, 0.0, 0.03, 0.0, 0.0, -0.02], atol=1e-7)
    np.testing.assert_allclose(estimator.GetOutputPort("com_z").Eval(context), [0.58, 0.0], atol=1e-7)
    soles = estimator.GetOutputPort("foot_state").Eval(context).reshape(2, 6)
    np.testing.assert_allclose(soles[:, :2], FEET, atol=1e-7)


def test_estimator_outputs_the_derivatives_of_the_com_and_the_tilt_of_the_soles(biped: Biped) -> None:
    soles = np.array([[0.05, 0.08, 0.01, 0.05, -0.03, 0.1], [-0.03, -0.08, 0.02, -0.02, 0.04, -0.1]])
    q, v, step = upright_posture(biped, np.array([0.0, 0.0, 0.57]), *soles), np.linspace(-1.0, 1.0, 18) + 0.07, 1e-6
    qdot = biped.plant.MapVelocityToQDot(_at(biped, q), v)
    estimator = unbundled(StateEstimator(biped))
    context = estimator.CreateDefaultContext()
    estimator.GetInputPort("contact_forces").FixValue(context, np.zeros(18))
    estimates = []
    for moved in (-step, step, 0.0):
        estimator.GetInputPort("robot_state").FixValue(context, np.concatenate([q + moved * qdot, v]))
        estimates.append([estimator.GetOutputPort(name).Eval(context).copy() for name in ("lip_state", "com_z")])
    (lip_before, z_before), (lip_after, z_after), (lip, z) = estimates
    np.testing.assert_allclose(lip[[1, 4]], (lip_after - lip_before)[[0, 3]] / (2 * step), atol=1e-6)
    np.testing.assert_allclose(z[1], (z_after - z_before)[0] / (2 * step), atol=1e-6)
    np.testing.assert_allclose(estimator.GetOutputPort("foot_state").Eval(context).reshape(2, 6), soles, atol=1e-7)
    assert np.all(np.abs([*lip[[1, 4]], z[1]]) > 0.01)


def test_estimator_keeps_the_last_zmp_while_nothing_is_loaded(biped: Biped, posture: np.ndarray) -> None:
    builder = DiagramBuilder()
    estimator = builder.AddSystem(unbundled(StateEstimator(biped)))
    memory = builder.AddSystem(last_zmp(0.01))
    builder.Connect(estimator.GetOutputPort("lip_state"), memory.get_input_port())
    builder.Connect(memory.get_output_port(), estimator.GetInputPort("last_zmp"))
    simulator = Simulator(builder.Build())
    context = estimator.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    estimator.GetInputPort("robot_state").FixValue(context, np.concatenate([posture, np.zeros(18)]))
    wrench = np.zeros(18)
    point, force = np.array([0.03, -0.02, 0.0]), np.array([0.0, 0.0, 280.0])
    wrench[biped.base_v_index] = np.concatenate([np.cross(point - posture[biped.base_q_index[4:]], force), force])
    found = []
    for tick, scale in enumerate((1.0, 0.0, 0.0, 1e-6)):
        estimator.GetInputPort("contact_forces").FixValue(context, scale * wrench)
        lip, load = (estimator.GetOutputPort(name).Eval(context).copy() for name in ("lip_state", "ground_load"))
        np.testing.assert_allclose(load, 280.0 * scale)
        found.append(lip[[2, 5]])
        simulator.AdvanceTo(0.01 * (tick + 0.5))
    np.testing.assert_allclose(found, [point[:2]] * 4, atol=1e-9)


def test_estimator_in_the_air_puts_the_zmp_under_the_com(biped: Biped, posture: np.ndarray) -> None:
    estimator = unbundled(StateEstimator(biped))
    context = estimator.CreateDefaultContext()
    estimator.GetInputPort("robot_state").FixValue(context, np.concatenate([posture, np.zeros(18)]))
    estimator.GetInputPort("contact_forces").FixValue(context, np.zeros(18))
    np.testing.assert_allclose(estimator.GetOutputPort("lip_state").Eval(context)[[2, 5]], 0.0, atol=1e-7)


def test_joint_targets_move_evenly_in_the_order_of_the_motors(biped: Biped, posture: np.ndarray) -> None:
    start_angles = posture[biped.q_index]
    block = joint_targets(biped, start_angles, 0.001)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    rates, feedforward = np.linspace(-0.3, 0.2, 12), np.linspace(-3.0, 3.0, 12)
    block.GetInputPort("desired_state").FixValue(context, np.concatenate([np.zeros(12), rates]))
    block.GetInputPort("feedforward").FixValue(context, feedforward)
    simulator.AdvanceTo(0.0095)  # ten steps of the integral; half a step more is the middle of the step that follows
    desired = block.GetOutputPort("plant_desired_state").Eval(context)
    np.testing.assert_allclose(desired[:12][biped.u_index], start_angles + 0.0105 * rates, atol=1e-15)
    np.testing.assert_allclose(desired[12:][biped.u_index], rates)
    np.testing.assert_allclose(block.GetOutputPort("plant_actuation").Eval(context)[biped.u_index], feedforward)


@pytest.mark.parametrize("push", [0.0, 1e4])
def test_the_plants_joint_control_is_implicit_pd_with_feedforward_within_the_limits(biped: Biped, push: float) -> None:
    """τ = sat(kp (q* − q⁺) + kd (q̇* − q̇⁺) + feedforward), with q⁺ and q̇⁺ at the end of the step."""
    scenario = load_scenario("walking")
    builder = DiagramBuilder()
    plant = add_robot(builder, scenario, biped, biped.bent_knee)
    robot = model_instance(plant, biped)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    rates, feedforward = np.linspace(-0.3, 0.2, 12), np.linspace(-3.0, 3.0, 12) + push
    joints = biped.bent_knee[biped.q_index] + 0.003
    order = np.argsort(biped.u_index)
    plant.get_desired_state_input_port(robot).FixValue(context, np.concatenate([joints[order], rates[order]]))
    plant.get_actuation_input_port().FixValue(context, feedforward[order])
    torque = plant.get_net_actuation_output_port(robot).Eval(context)[biped.u_index]
    simulator.AdvanceTo(plant.time_step())
    q, v = plant.GetPositions(context)[biped.q_index], plant.GetVelocities(context)[biped.v_index]
    wanted = biped.kp * (joints - q) + biped.kd * (rates - v) + feedforward
    np.testing.assert_allclose(torque, np.clip(wanted, -biped.effort_limits, biped.effort_limits), rtol=1e-5, atol=1e-4)
    assert bool(push) == bool(np.all(np.abs(torque) == biped.effort_limits))
