"""Each block alone in its context."""

import numpy as np
import pytest
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem
from walks import make_mpc, speed_limit, start

from pdhocbf_drake.barriers import AffineBarrier, Linear, harmonic
from pdhocbf_drake.biped import Biped, InverseDynamics, sole_pose
from pdhocbf_drake.gait import Gait, GaitConfig, swing_point
from pdhocbf_drake.mpc.solution import Reason
from pdhocbf_drake.simulation.biped_diagram import add_robot, model_instance
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.systems.barrier_schedule import BarrierSchedule
from pdhocbf_drake.systems.fall_detector import FallDetector
from pdhocbf_drake.systems.foot_reference import FootReference
from pdhocbf_drake.systems.gait_reference import GaitReference
from pdhocbf_drake.systems.inverse_kinematics import InverseKinematics
from pdhocbf_drake.systems.joint_targets import joint_targets
from pdhocbf_drake.systems.lean_detector import LeanDetector
from pdhocbf_drake.systems.mpc_controller import MpcController
from pdhocbf_drake.systems.oscillator import TubeFilter
from pdhocbf_drake.systems.push_schedule import PushSchedule, TimedForce
from pdhocbf_drake.systems.state_estimator import StateEstimator
from pdhocbf_drake.systems.vhip_plant import VhipPlant
from pdhocbf_drake.systems.zmp_offset import ZmpOffset
from pdhocbf_drake.templates.config import VanDerPolConfig
from pdhocbf_drake.templates.van_der_pol_tube import VanDerPolTube

GAIT = Gait(GaitConfig())
FEET = np.array([[0.0, 0.08], [0.0, -0.08]])


@pytest.fixture(scope="module")
def biped() -> Biped:
    return Biped.load("biped")


@pytest.fixture(scope="module")
def posture(biped: Biped) -> np.ndarray:
    return biped.posture(np.array([0.0, 0.0, 0.58]), sole_pose(0.0, 0.08), sole_pose(0.0, -0.08))


def test_clock_speaks_of_the_next_tick_once_updated() -> None:
    clock = GaitReference(GAIT)
    simulator = Simulator(clock)
    context = simulator.get_context()
    np.testing.assert_array_equal(clock.GetOutputPort("gait_phase").Eval(context), [0, 0, 0])
    simulator.AdvanceTo(0.805)  # ticks 0 … 80 are over, the robot moves towards tick 81
    np.testing.assert_array_equal(clock.GetOutputPort("gait_phase").Eval(context), [1, 2, -1])
    np.testing.assert_allclose(clock.GetOutputPort("com_height").Eval(context), GAIT.height(81))


def test_clock_lets_both_feet_stand_after_the_last_step() -> None:
    clock = GaitReference(GAIT)
    simulator = Simulator(clock)
    context = simulator.get_mutable_context()
    simulator.AdvanceTo(1.605)  # towards tick 161, the second of step 4
    for last_step, support in ((-1.0, GAIT.support(4)), (4.0, GAIT.support(4)), (3.0, 0.0)):
        clock.GetInputPort("last_step").FixValue(context, [last_step])
        np.testing.assert_array_equal(clock.GetOutputPort("gait_phase").Eval(context), [1, 4, support])
    assert GAIT.support(4) != 0


def test_barrier_schedule_plays_bounds_and_h() -> None:
    barriers = [speed_limit(0.5), speed_limit(0.2)]
    schedule = BarrierSchedule([0, 1], barriers, 40, 80)
    context = schedule.CreateDefaultContext()
    schedule.GetInputPort("gait_phase").FixValue(context, [3.0, 2.0, 1.0])
    schedule.GetInputPort("lip_state").FixValue(context, [0.0, 0.45, 0.0, 0.0, 0.25, 0.0])
    np.testing.assert_allclose(schedule.GetOutputPort("h").Eval(context), [0.05, -0.05])
    bounds = schedule.GetOutputPort("velocity_bound").Eval(context)
    np.testing.assert_allclose(bounds, np.repeat([0.5, 0.2], 81))


def test_barrier_schedule_plays_the_sample_of_its_tick_and_those_that_follow() -> None:
    bound = harmonic(0.5, 0.1, 0.05, 80)
    barrier = AffineBarrier("limit", [0.0, 1.0, 0.0], bound, 1, [Linear(0.5), Linear(0.5)], "m/s")
    schedule = BarrierSchedule([1], [barrier], 40, 80)
    context = schedule.CreateDefaultContext()
    schedule.GetInputPort("gait_phase").FixValue(context, [7.0, 3.0, 1.0])
    schedule.GetInputPort("lip_state").FixValue(context, [0.0, 9.0, 0.0, 0.0, 0.2, 0.0])
    np.testing.assert_allclose(schedule.GetOutputPort("velocity_bound").Eval(context), bound.samples(127, 81))
    np.testing.assert_allclose(schedule.GetOutputPort("h").Eval(context), bound(127) - 0.2)


def _controller(barriers: tuple = (), **state: float) -> tuple[MpcController, object]:
    mpc = make_mpc(barriers=barriers)
    memory = start(mpc)
    controller = MpcController(mpc, memory.state, memory.feet, [(0, b.name) for b in barriers])
    context = controller.CreateDefaultContext()
    controller.GetInputPort("gait_phase").FixValue(context, [0.0, 0.0, 0.0])
    lip = np.zeros(6)
    lip[1] = state.get("vx", 0.0)
    controller.GetInputPort("lip_state").FixValue(context, lip)
    if barriers:
        controller.GetInputPort("velocity_bound").FixValue(context, np.full(81, 0.5))
    return controller, context


def _update(block: LeafSystem, context: object) -> None:
    context.SetDiscreteState(block.EvalUniquePeriodicDiscreteUpdate(context))  # type: ignore[attr-defined]


def test_controller_starts_physical_and_plans_the_next_tick() -> None:
    controller, context = _controller((speed_limit(0.5),))
    np.testing.assert_array_equal(controller.GetOutputPort("com_reference").Eval(context), np.zeros(6))
    _update(controller, context)
    x, vx, ax, *_ = controller.GetOutputPort("com_reference").Eval(context)
    zmp, velocity, *_ = controller.GetOutputPort("zmp_reference").Eval(context)
    assert (x, vx) == (0.0, 0.0) and zmp == pytest.approx(0.01 * velocity)
    assert ax == pytest.approx(-GAIT.height.eta()[1] * zmp)
    status = controller.GetOutputPort("solver_status").Eval(context)
    assert status[0] == 1.0 and status[4] == 0.0 and status[5] == Reason.SOLVED


def test_controller_plans_from_the_tick_that_the_clock_tells() -> None:
    controller, context = _controller()
    controller.GetInputPort("gait_phase").FixValue(context, [7.0, 3.0, -1.0])
    _update(controller, context)
    mpc = make_mpc()
    memory = start(mpc)
    plan = mpc.solve(3 * 40 + 7, memory.state, memory.stance, {})
    planned = controller.GetOutputPort("zmp_reference").Eval(context)
    np.testing.assert_allclose(planned, np.stack([0.01 * plan.inputs[:, 0], plan.inputs[:, 0]], axis=1).ravel())


def test_controller_takes_the_landed_foot_where_it_is_measured_and_leaves_the_other() -> None:
    controller, context = _controller()
    controller.GetInputPort("gait_phase").FixValue(context, [0.0, 3.0, 1.0])
    soles = np.array([[0.31, 0.09, 0.001, 0.0, 0.0, 0.2], [0.5, 0.5, 0.5, 0.5, 0.5, 0.5]])
    controller.GetInputPort("foot_state").FixValue(context, soles.ravel())
    _update(controller, context)
    starts = controller.GetOutputPort("foot_plan").Eval(context).reshape(2, 2, 2)[:, 0]
    np.testing.assert_array_equal(starts, [[0.31, 0.09], FEET[1]])  # the left one, which now stands
    np.testing.assert_array_equal(controller.GetOutputPort("stance_plan").Eval(context)[2:4], [0.31, 0.09])


def test_controller_that_gives_up_before_the_first_step_goes_on_standing() -> None:
    mpc = make_mpc(mpc={"stop_ticks": 1})
    controller = MpcController(mpc, np.zeros((2, 3)), FEET, [])
    context = controller.CreateDefaultContext()
    ends = []
    for tick, measured in ((0, np.zeros(6)), (1, np.full(6, np.nan)), (2, np.zeros(6))):
        controller.GetInputPort("gait_phase").FixValue(context, [tick, 0.0, 0.0])
        controller.GetInputPort("lip_state").FixValue(context, measured)
        _update(controller, context)
        ends.append(controller.GetOutputPort("stance_plan").Eval(context).reshape(4, 2)[2:])
    assert controller.GetOutputPort("last_step").Eval(context)[0] == 1.0
    # The second coming stance was to be one foot, and is now the middle between both.
    assert abs(ends[0][1, 1]) > 0.05
    np.testing.assert_allclose(ends[2][1, 1], 0.0, atol=1e-6)


def test_controller_is_a_function_of_its_context() -> None:
    controller, context = _controller()
    copy = context.Clone()  # type: ignore[attr-defined]
    for c in (context, copy, context, copy):
        _update(controller, c)
    plans = [controller.GetOutputPort("com_reference").Eval(c) for c in (context, copy)]
    np.testing.assert_array_equal(plans[0], plans[1])


def test_a_measurement_that_is_not_a_number_is_replaced_by_the_prediction_and_said() -> None:
    controller, context = _controller()
    _update(controller, context)
    blind = context.Clone()  # type: ignore[attr-defined]
    for c, lip in ((context, np.zeros(6)), (blind, np.full(6, np.nan))):
        controller.GetInputPort("gait_phase").FixValue(c, [1.0, 0.0, 0.0])
        controller.GetInputPort("lip_state").FixValue(c, lip)
        _update(controller, c)
    reasons = [controller.GetOutputPort("solver_status").Eval(c)[5] for c in (context, blind)]
    assert reasons == [Reason.SOLVED, Reason.BAD_MEASUREMENT]
    assert np.all(np.isfinite(controller.GetOutputPort("com_reference").Eval(blind)))


def test_the_tube_filter_tells_its_barriers_apart() -> None:
    tube = VanDerPolTube(VanDerPolConfig())
    block = TubeFilter(tube)
    context = block.CreateDefaultContext()
    block.GetInputPort("oscillator_state").FixValue(context, [3.0, 0.0])  # beyond the upper bound of x1
    _update(block, context)
    slack = block.GetOutputPort("barrier_slack").Eval(context)
    assert [barrier.name for barrier, by in zip(tube.barriers, slack, strict=True) if by > 1e-6] == [
        "x1_upper", "x2_lower",  # no input is slow enough for the one and fast enough for the other
    ]  # fmt: skip
    status = block.GetOutputPort("solver_status").Eval(context)
    assert status[3] == slack.max() and status[5] == Reason.SOFTENED


def test_template_plant_steps_half_a_tick_after_the_controller() -> None:
    mpc = make_mpc()
    start_state = np.array([[0.1, 0.2, 0.1], [0.0, 0.1, 0.02]])
    plant = VhipPlant(mpc.vhip, start_state, 29.0)
    simulator = Simulator(plant)
    context = simulator.get_mutable_context()
    plant.GetInputPort("gait_phase").FixValue(context, [8.0, 0.0, 0.0])  # the clock's tick 8: we move from 7
    plant.GetInputPort("zmp_reference").FixValue(context, [9.0, 0.3, 9.0, -0.2])
    simulator.AdvanceTo(0.004)
    np.testing.assert_allclose(plant.GetOutputPort("lip_state").Eval(context), start_state.ravel())
    simulator.AdvanceTo(0.009)
    expected = [mpc.vhip.step(7, start_state[0], 0.3), mpc.vhip.step(7, start_state[1], -0.2)]
    np.testing.assert_allclose(plant.GetOutputPort("lip_state").Eval(context), np.ravel(expected))


def test_stance_foot_rests_and_swing_foot_reaches_its_foothold() -> None:
    feet = FootReference(GAIT)
    context = feet.CreateDefaultContext()
    plan = [0.0, 0.08, 0.3, 0.08, 0.15, -0.08, 0.15, -0.08]
    feet.GetInputPort("foot_plan").FixValue(context, plan)
    heights = []
    for tick in range(41):
        feet.GetInputPort("gait_phase").FixValue(context, [tick, 4.0, -1.0])
        left, right = feet.GetOutputPort("foot_reference").Eval(context).reshape(2, 3, 3)
        np.testing.assert_allclose(right, [[0.15, -0.08, 0.0], [0, 0, 0], [0, 0, 0]], atol=1e-12)
        heights.append(left[0, 2])
        if tick <= 4:
            np.testing.assert_allclose(left[0], [0.0, 0.08, 0.0], atol=1e-12)
    assert max(heights) == pytest.approx(0.05)
    np.testing.assert_allclose(left[0], [0.3, 0.08, 0.0], atol=1e-12)


@pytest.mark.parametrize("support", [1.0, -1.0])
def test_the_swing_foot_is_at_every_tick_where_the_minimum_jerk_swing_has_it(support: float) -> None:
    feet, swinging = FootReference(GAIT), 1 if support > 0 else 0
    context = feet.CreateDefaultContext()
    plan = np.array([[[0.0, 0.08], [0.0, 0.08]], [[0.15, -0.08], [0.15, -0.08]]])
    plan[swinging, 1] += [0.3, 0.02]
    feet.GetInputPort("foot_plan").FixValue(context, plan.ravel())
    config, duration = GAIT.config, GAIT.swing_ticks() * GAIT.config.tick
    for tick in range(40):
        feet.GetInputPort("gait_phase").FixValue(context, [tick, 4.0, support])
        told = feet.GetOutputPort("foot_reference").Eval(context).reshape(2, 3, 3)[swinging]
        time = (tick - config.double_support_ticks) * config.tick
        np.testing.assert_allclose(told, swing_point(*plan[swinging], config.swing_height, duration, time), atol=1e-9)
        _update(feet, context)


def test_kinematics_meets_the_plan_and_its_rates_lead_there(biped: Biped, posture: np.ndarray) -> None:
    block = InverseKinematics(biped, posture, 0.01)
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


def _kinematics(biped: Biped, posture: np.ndarray, **given: object) -> tuple[InverseKinematics, object]:
    """The block before its first tick, standing still over both feet but for what is given."""
    block = InverseKinematics(biped, posture, 0.01)
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
def test_each_foot_carries_what_the_zmp_says_and_a_lifted_one_nothing(
    biped: Biped, posture: np.ndarray, lift: tuple[float, float], zmp: float, share: float
) -> None:
    feet = _at_rest([0.05, 0.08, lift[0]], [0.05, -0.08, lift[1]])
    wanted = {"com_reference": [0.01, 0, 0, 0, 0, 0], "zmp_reference": [0.05, 0.0, zmp, 0.0], "foot_reference": feet}
    block, context = _kinematics(biped, posture, **wanted)
    told = block.GetOutputPort("feedforward").Eval(context)
    # Nothing moves, so that the ZMP is under the CoM whoever carries how much.
    np.testing.assert_allclose(block.GetOutputPort("whole_body_zmp").Eval(context), [0.01, 0.0], atol=1e-6)
    _update(block, context)
    q, v, vdot = np.split(context.get_discrete_state_vector().value(), [19, 37])  # type: ignore[attr-defined]
    np.testing.assert_allclose(told, InverseDynamics(biped)(q, v, vdot, share).tau, atol=1e-9)


def test_kinematics_starts_where_the_last_motion_leads(biped: Biped, posture: np.ndarray) -> None:
    """A motion that goes on as it was is met in fewer iterations than one that starts from rest, v and v̇ told."""
    feet = _at_rest([0.0, 0.08, 0.0], [0.0, -0.08, 0.0])
    block, context = _kinematics(biped, posture, com_reference=[0, 0.5, 3.0, 0, 0, 0], foot_reference=feet)
    _update(block, context)
    moving = context.get_discrete_state_vector().value().copy()  # type: ignore[attr-defined]
    onward = [0.01 * 0.5 + 0.5 * 0.01**2 * 3.0, 0.53, 3.0, 0, 0, 0]
    block.GetInputPort("com_reference").FixValue(context, onward)
    iterations = []
    for kept in (37 + 18, 37, 19):  # all, without the acceleration, without the velocity
        context.SetDiscreteState(np.where(np.arange(55) < kept, moving, 0.0))  # type: ignore[attr-defined]
        iterations.append(block.GetOutputPort("ik_status").Eval(context)[2])
    assert iterations[0] < min(iterations[1:])


@pytest.mark.parametrize("support", [1.0, -1.0])
def test_of_a_plan_out_of_reach_the_standing_foot_is_where_it_should_be(
    biped: Biped, posture: np.ndarray, support: float
) -> None:
    soles = [[0.0, 0.08, 0.0], [0.0, -0.08, 0.0]]
    standing = 0 if support > 0 else 1
    soles[1 - standing][0] = 0.9
    block, context = _kinematics(biped, posture, foot_reference=_at_rest(*soles), gait_phase=[20.0, 3.0, support])
    assert block.GetOutputPort("ik_status").Eval(context)[0] == 0.0
    _update(block, context)
    reached = _at(biped, context.get_discrete_state_vector().value()[:19])  # type: ignore[attr-defined]
    found = [biped.soles[side].frame.CalcPoseInWorld(reached).translation() for side in ("left", "right")]
    missed = np.linalg.norm(np.array(found) - soles, axis=1)
    assert missed[standing] < 1e-3 and missed[1 - standing] > 0.1


def test_a_robot_that_is_raised_has_its_zmp_moved_along_the_ground_reaction(biped: Biped, posture: np.ndarray) -> None:
    """The ZMP is a point of the ground at z = 0: it moves by −Δz (ẍ, ÿ)/(g + z̈), wherever the soles are."""
    zmp, com = [], [0.0, 0.0, 1.2, 0.0, 0.0, -0.8]
    for raised in (0.0, 0.03):
        feet, height = _at_rest([0.0, 0.08, raised], [0.0, -0.08, raised]), [0.58 + raised, 0.0, 0.5]
        block, context = _kinematics(biped, posture, com_height=height, com_reference=com, foot_reference=feet)
        zmp.append(block.GetOutputPort("whole_body_zmp").Eval(context))
        assert block.GetOutputPort("ik_status").Eval(context)[0] == 1.0
    np.testing.assert_allclose(zmp[1] - zmp[0], -0.03 / (9.81 + 0.5) * np.array([1.2, -0.8]), atol=1e-7)


def test_an_unreachable_plan_gives_finite_targets_and_says_so(biped: Biped, posture: np.ndarray) -> None:
    block = InverseKinematics(biped, posture, 0.01)
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


def test_estimator_finds_com_soles_and_zmp(biped: Biped, posture: np.ndarray) -> None:
    estimator = StateEstimator(biped)
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


def test_estimator_tells_the_derivatives_of_the_com_and_the_tilt_of_the_soles(biped: Biped) -> None:
    soles = np.array([[0.05, 0.08, 0.01, 0.05, -0.03, 0.1], [-0.03, -0.08, 0.02, -0.02, 0.04, -0.1]])
    q, v, step = biped.posture(np.array([0.0, 0.0, 0.57]), *soles), np.linspace(-1.0, 1.0, 18) + 0.07, 1e-6
    qdot = biped.plant.MapVelocityToQDot(_at(biped, q), v)
    estimator = StateEstimator(biped)
    context = estimator.CreateDefaultContext()
    estimator.GetInputPort("contact_forces").FixValue(context, np.zeros(18))
    told = []
    for moved in (-step, step, 0.0):
        estimator.GetInputPort("robot_state").FixValue(context, np.concatenate([q + moved * qdot, v]))
        told.append([estimator.GetOutputPort(name).Eval(context).copy() for name in ("lip_state", "com_z")])
    (lip_before, z_before), (lip_after, z_after), (lip, z) = told
    np.testing.assert_allclose(lip[[1, 4]], (lip_after - lip_before)[[0, 3]] / (2 * step), atol=1e-6)
    np.testing.assert_allclose(z[1], (z_after - z_before)[0] / (2 * step), atol=1e-6)
    np.testing.assert_allclose(estimator.GetOutputPort("foot_state").Eval(context).reshape(2, 6), soles, atol=1e-7)
    assert np.all(np.abs([*lip[[1, 4]], z[1]]) > 0.01)


def test_estimator_in_the_air_puts_the_zmp_under_the_com(biped: Biped, posture: np.ndarray) -> None:
    estimator = StateEstimator(biped)
    context = estimator.CreateDefaultContext()
    estimator.GetInputPort("robot_state").FixValue(context, np.concatenate([posture, np.zeros(18)]))
    estimator.GetInputPort("contact_forces").FixValue(context, np.zeros(18))
    np.testing.assert_allclose(estimator.GetOutputPort("lip_state").Eval(context)[[2, 5]], 0.0, atol=1e-7)


def test_offset_is_learned_per_tick_of_the_step_and_mirrored() -> None:
    block = ZmpOffset(GAIT, 80)
    context = block.CreateDefaultContext()
    for _ in range(60):
        block.GetInputPort("gait_phase").FixValue(context, [10.0, 3.0, 1.0])
        block.GetInputPort("zmp_reference").FixValue(context, [1.0, 0.0, 0.1, 0.0])
        block.GetInputPort("whole_body_zmp").FixValue(context, [1.02, 0.11])
        _update(block, context)
    block.GetInputPort("gait_phase").FixValue(context, [9.0, 3.0, 1.0])
    x, y = block.GetOutputPort("zmp_offset").Eval(context).reshape(2, 80)
    np.testing.assert_allclose([x[0], x[40], y[0], y[40]], [0.02, 0.02, 0.01, -0.01], atol=1e-9)
    assert np.count_nonzero(np.abs(x) > 1e-12) == 2
    block.GetInputPort("whole_body_zmp").FixValue(context, [np.nan, 5.0])
    _update(block, context)
    assert np.all(np.isfinite(block.GetOutputPort("zmp_offset").Eval(context)))


def test_offset_learned_on_one_foot_is_the_mirror_of_that_learned_on_the_other() -> None:
    block = ZmpOffset(GAIT, 80)
    tables = []
    for support in (1.0, -1.0):
        context = block.CreateDefaultContext()
        block.GetInputPort("gait_phase").FixValue(context, [10.0, 3.0, support])
        block.GetInputPort("zmp_reference").FixValue(context, [1.0, 0.0, 0.1 * support, 0.0])
        block.GetInputPort("whole_body_zmp").FixValue(context, [1.02, 0.11 * support])
        _update(block, context)
        tables.append(context.get_discrete_state_vector().value().copy())  # type: ignore[attr-defined]
    assert np.count_nonzero(tables[0]) == 2
    np.testing.assert_allclose(tables[1], tables[0], atol=1e-15)


def test_where_the_walk_comes_to_a_stand_no_offset_is_expected() -> None:
    block = ZmpOffset(GAIT, 80)
    context = block.CreateDefaultContext()
    context.SetDiscreteState(np.full(80, 0.01))
    block.GetInputPort("gait_phase").FixValue(context, [9.0, 3.0, 1.0])
    block.GetInputPort("last_step").FixValue(context, [4.0])  # of which ticks 0 … 39 are k + 31 … k + 70
    x, y = block.GetOutputPort("zmp_offset").Eval(context).reshape(2, 80)
    np.testing.assert_allclose(x, np.repeat([0.01, 0.01, 0.0], [30, 40, 10]))
    np.testing.assert_allclose(y, np.repeat([0.01, -0.01, 0.0], [30, 40, 10]))


@pytest.mark.parametrize("support", [1.0, -1.0])
def test_offset_of_a_swinging_leg_is_foretold_by_its_lever_and_not_learned(support: float) -> None:
    """What the whole body's ZMP shows of the swing is what was expected of it, so that nothing is left to the table.

    Foretold are the rest of this step and the next one, in which the other foot swings to the stance after the coming.
    """
    lever, swinging = np.array([-0.002, -0.003]), 1 if support > 0 else 0
    block = ZmpOffset(GAIT, 80, lever)
    context = block.CreateDefaultContext()
    plan = np.array([[[0.0, 0.08], [0.0, 0.08]], [[0.15, -0.08], [0.15, -0.08]]])
    plan[swinging, 1] += [0.3, 0.02]
    after = plan[1 - swinging, 0] + [0.5, -0.03]
    lift_off, duration = GAIT.config.double_support_ticks, GAIT.swing_ticks() * GAIT.config.tick

    def at(tick: int) -> np.ndarray:
        """Position, velocity, acceleration of both soles, the standing one of which must not count."""
        feet = np.full((2, 3, 3), 0.7)
        feet[swinging] = swing_point(*plan[swinging], 0.05, duration, (tick - lift_off) * GAIT.config.tick)
        return feet

    def next_step(tick: int) -> np.ndarray:
        time = (tick - lift_off) * GAIT.config.tick
        return swing_point(plan[1 - swinging, 1], after, 0.05, duration, time).acceleration

    block.GetInputPort("gait_phase").FixValue(context, [10.0, 3.0 if support > 0 else 4.0, support])
    block.GetInputPort("foot_reference").FixValue(context, at(10).ravel())
    block.GetInputPort("foot_plan").FixValue(context, plan.ravel())
    block.GetInputPort("stance_plan").FixValue(context, [9.0, 9.0, 9.0, 9.0, 9.0, 9.0, *after])
    block.GetInputPort("zmp_reference").FixValue(context, np.zeros(4))
    seen = lever * at(10)[swinging, 2, :2]
    block.GetInputPort("whole_body_zmp").FixValue(context, seen)
    _update(block, context)
    np.testing.assert_allclose(context.get_discrete_state_vector().value(), 0.0, atol=1e-15)  # type: ignore[attr-defined]
    foretold = block.GetOutputPort("zmp_offset").Eval(context).reshape(2, 80)
    wanted = [at(tick)[swinging, 2] for tick in range(11, 40)] + [next_step(tick) for tick in range(40)]
    np.testing.assert_allclose(foretold[:, :69].T, lever * np.array(wanted)[:, :2], atol=1e-9)
    assert np.all(np.abs(seen) > 1e-4)


def test_joint_targets_move_evenly_in_the_order_of_the_motors(biped: Biped, posture: np.ndarray) -> None:
    start_angles = posture[biped.q_index]
    block = joint_targets(biped, start_angles, 0.001)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    rates, feedforward = np.linspace(-0.3, 0.2, 12), np.linspace(-3.0, 3.0, 12)
    block.GetInputPort("desired_state").FixValue(context, np.concatenate([np.zeros(12), rates]))
    block.GetInputPort("feedforward").FixValue(context, feedforward)
    simulator.AdvanceTo(0.0095)  # ten steps of the integral; half a step more is the middle of the step that follows
    told = block.GetOutputPort("plant_desired_state").Eval(context)
    np.testing.assert_allclose(told[:12][biped.u_index], start_angles + 0.0105 * rates, atol=1e-15)
    np.testing.assert_allclose(told[12:][biped.u_index], rates)
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


def test_a_push_acts_from_its_first_to_its_last_tick() -> None:
    force = TimedForce(BodyIndex(1), np.array([0.0, 0.0, 0.1]), np.array([5.0, 0.0, 0.0]), 3, 5)
    block = PushSchedule([force], 0.01)
    simulator = Simulator(block)
    context = simulator.get_context()
    seen = []
    for tick in range(7):
        simulator.AdvanceTo(0.01 * tick + 0.005)
        applied: list[ExternallyAppliedSpatialForce] = block.GetOutputPort("applied_spatial_force").Eval(context)
        assert len(applied) == (tick in (3, 4))
        for entry in applied:
            assert entry.body_index == force.body
            np.testing.assert_array_equal(entry.p_BoBq_B, force.point)
            np.testing.assert_array_equal(entry.F_Bq_W.translational(), force.force)
            np.testing.assert_array_equal(entry.F_Bq_W.rotational(), 0.0)
        seen.append(block.GetOutputPort("push").Eval(context)[0])
    assert seen == [0, 0, 0, 5, 5, 0, 0]


@pytest.mark.parametrize("height", [0.3, np.nan])
def test_a_fall_ends_the_run(height: float) -> None:
    block = FallDetector(0.58, 0.01)
    simulator = Simulator(block)
    block.GetInputPort("com_z").FixValue(simulator.get_mutable_context(), [0.58, 0.0])
    assert simulator.AdvanceTo(0.05).reason() == SimulatorStatus.ReturnReason.kReachedBoundaryTime
    block.GetInputPort("com_z").FixValue(simulator.get_mutable_context(), [height, 0.0])
    assert simulator.AdvanceTo(0.1).reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition


@pytest.mark.parametrize(
    ("com", "zmp", "fell"),
    [
        ((9.0, -3.0), (9.3, -3.4), False), ((9.0, -3.0), (9.5, -3.4), True), ((9.0, -3.0), (9.4, -2.5), True),
        ((-1.0, 0.0), (1.0, 0.0), True), ((0.0, -1.0), (0.0, 1.0), True), ((0.0, 0.0), (0.0, np.nan), True),
    ],
)  # fmt: skip
def test_a_com_farther_from_the_zmp_than_it_is_high_ends_the_run(com: tuple, zmp: tuple, fell: bool) -> None:
    block = LeanDetector(0.58, 0.01)
    simulator = Simulator(block)
    state = [com[0], 50.0, zmp[0], com[1], 50.0, zmp[1]]
    block.GetInputPort("lip_state").FixValue(simulator.get_mutable_context(), state)
    ended = SimulatorStatus.ReturnReason.kReachedTerminationCondition
    assert (simulator.AdvanceTo(0.05).reason() == ended) == fell
