"""Each block by itself, in a context of its own."""

import numpy as np
import pytest
from contexts import update
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import Context, Diagram
from walks import make_mpc, speed_limit, start

from pdhocbf_drake.barriers import AffineBarrier, Linear, harmonic
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.oscillator.config import VanDerPolConfig
from pdhocbf_drake.oscillator.van_der_pol_tube import VanDerPolTube
from pdhocbf_drake.systems.barrier_schedule import BarrierSchedule
from pdhocbf_drake.systems.fall_detector import FallDetector, LeanDetector
from pdhocbf_drake.systems.foot_reference import FootReference
from pdhocbf_drake.systems.gait_reference import GaitReference
from pdhocbf_drake.systems.mpc_controller import MpcController
from pdhocbf_drake.systems.oscillator import TubeFilter
from pdhocbf_drake.systems.push_schedule import PushSchedule, TimedForce
from pdhocbf_drake.systems.unbundled import unbundled
from pdhocbf_drake.systems.vhip_plant import VhipPlant
from pdhocbf_drake.walking import Gait, GaitConfig, swing_point

GAIT = Gait(GaitConfig())
FEET = np.array([[0.0, 0.08], [0.0, -0.08]])


def test_clock_outputs_the_next_tick_once_updated() -> None:
    clock = unbundled(GaitReference(GAIT))
    simulator = Simulator(clock)
    context = simulator.get_context()
    np.testing.assert_array_equal(clock.GetOutputPort("gait_phase").Eval(context), [0, 0, 0])
    simulator.AdvanceTo(0.805)  # ticks 0 … 80 are over, the robot moves towards tick 81
    np.testing.assert_array_equal(clock.GetOutputPort("gait_phase").Eval(context), [1, 2, -1])
    np.testing.assert_allclose(clock.GetOutputPort("com_height").Eval(context), GAIT.height(81))


def test_clock_lets_both_feet_stand_after_the_last_step() -> None:
    clock = unbundled(GaitReference(GAIT))
    simulator = Simulator(clock)
    context = simulator.get_mutable_context()
    simulator.AdvanceTo(1.605)  # towards tick 161, the second of step 4
    clock.GetInputPort("resumed").FixValue(context, [165.0, 1.0, 5.0])  # tick 5 of step 4
    clock.GetInputPort("last_step").FixValue(context, [2.0])
    assert clock.GetOutputPort("gait_phase").Eval(context)[2] == 1.0
    clock.GetInputPort("resumed").FixValue(context, [-1.0, 0.0, -1.0])
    for last_step, support in ((-1.0, GAIT.support(4)), (4.0, GAIT.support(4)), (3.0, 0.0)):
        clock.GetInputPort("last_step").FixValue(context, [last_step])
        np.testing.assert_array_equal(clock.GetOutputPort("gait_phase").Eval(context), [1, 4, support])
    assert GAIT.support(4) != 0


def test_barrier_schedule_plays_bounds_and_h() -> None:
    barriers = [speed_limit(0.5), speed_limit(0.2)]
    schedule = unbundled(BarrierSchedule([0, 1], barriers, GAIT, 80))
    context = schedule.CreateDefaultContext()
    schedule.GetInputPort("gait_phase").FixValue(context, [3.0, 2.0, 1.0])
    schedule.GetInputPort("lip_state").FixValue(context, [0.0, 0.45, 0.0, 0.0, 0.25, 0.0])
    np.testing.assert_allclose(schedule.GetOutputPort("h").Eval(context), [0.05, -0.05])
    bounds = schedule.GetOutputPort("barrier_bound").Eval(context)
    np.testing.assert_allclose(bounds, np.repeat([0.5, 0.2], 81))


def test_nan_on_one_axis_leaves_the_h_of_the_other_axis() -> None:
    schedule = unbundled(BarrierSchedule([0, 1], [speed_limit(0.5), speed_limit(0.2)], GAIT, 80))
    context = schedule.CreateDefaultContext()
    schedule.GetInputPort("gait_phase").FixValue(context, [3.0, 2.0, 1.0])
    schedule.GetInputPort("lip_state").FixValue(context, [np.nan, 0.45, np.inf, 0.0, np.nan, 0.0])
    np.testing.assert_array_equal(np.isnan(schedule.GetOutputPort("h").Eval(context)), [True, True])
    schedule.GetInputPort("lip_state").FixValue(context, [0.0, 0.45, 0.0, np.inf, np.nan, np.nan])
    h = schedule.GetOutputPort("h").Eval(context)
    assert h[0] == pytest.approx(0.05)
    assert np.isnan(h[1])


def test_barrier_schedule_plays_the_sample_of_its_tick_and_those_that_follow() -> None:
    bound = harmonic(0.5, 0.1, 0.05, 80)
    barrier = AffineBarrier("limit", [0.0, 1.0, 0.0], bound, 1, [Linear(0.5), Linear(0.5)], "m/s")
    schedule = unbundled(BarrierSchedule([1], [barrier], GAIT, 80))
    context = schedule.CreateDefaultContext()
    schedule.GetInputPort("gait_phase").FixValue(context, [7.0, 3.0, 1.0])
    schedule.GetInputPort("lip_state").FixValue(context, [0.0, 9.0, 0.0, 0.0, 0.2, 0.0])
    np.testing.assert_allclose(schedule.GetOutputPort("barrier_bound").Eval(context), bound.samples(127, 81))
    np.testing.assert_allclose(schedule.GetOutputPort("h").Eval(context), bound(127) - 0.2)


def test_h_is_taken_with_the_normal_of_its_tick() -> None:
    normals = np.random.default_rng(0).normal(size=(8, 3))
    barriers = [AffineBarrier("moving", normals, harmonic(0.5, 0.1, 0.0, 40), -1, [Linear(0.5)]), speed_limit(0.5)]
    schedule = unbundled(BarrierSchedule([1, 0], barriers, GAIT, 80))
    context = schedule.CreateDefaultContext()
    lip = np.arange(6.0)
    schedule.GetInputPort("lip_state").FixValue(context, lip)
    for tick in (0, 7, 93):
        schedule.GetInputPort("gait_phase").FixValue(context, [tick % 40, tick // 40, 1.0])
        h = schedule.GetOutputPort("h").Eval(context)
        np.testing.assert_allclose(h, [barriers[0].h(tick, lip[3:]), barriers[1].h(tick, lip[:3])])


def _controller(barriers: tuple = (), **state: float) -> tuple[Diagram, Context]:
    mpc = make_mpc(barriers=barriers)
    memory = start(mpc)
    controller = unbundled(MpcController(mpc, memory.state, memory.feet, [(0, b.name) for b in barriers]))
    context = controller.CreateDefaultContext()
    controller.GetInputPort("gait_phase").FixValue(context, [0.0, 0.0, 0.0])
    lip = np.zeros(6)
    lip[1] = state.get("vx", 0.0)
    controller.GetInputPort("lip_state").FixValue(context, lip)
    if barriers:
        controller.GetInputPort("barrier_bound").FixValue(context, np.full(81, 0.5))
    return controller, context


def test_controller_starts_physical_and_plans_the_next_tick() -> None:
    controller, context = _controller((speed_limit(0.5),))
    np.testing.assert_array_equal(controller.GetOutputPort("com_reference").Eval(context), np.zeros(6))
    update(controller, context)
    x, vx, ax, *_ = controller.GetOutputPort("com_reference").Eval(context)
    zmp, velocity, *_ = controller.GetOutputPort("zmp_reference").Eval(context)
    assert (x, vx) == (0.0, 0.0)
    assert zmp == pytest.approx(0.01 * velocity)
    assert ax == pytest.approx(-GAIT.height.eta()[1] * zmp)
    status = controller.GetOutputPort("solver_status").Eval(context)
    assert status[0] == 1.0
    assert status[4] == 0.0
    assert status[5] == Reason.SOLVED


def test_controller_plans_from_the_tick_of_the_clock() -> None:
    controller, context = _controller()
    controller.GetInputPort("gait_phase").FixValue(context, [7.0, 3.0, -1.0])
    update(controller, context)
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
    update(controller, context)
    starts = controller.GetOutputPort("foot_plan").Eval(context).reshape(2, 2, 2)[:, 0]
    np.testing.assert_array_equal(starts, [[0.31, 0.09], FEET[1]])  # the left one, which now stands
    np.testing.assert_array_equal(controller.GetOutputPort("stance_plan").Eval(context)[2:4], [0.31, 0.09])


def test_controller_that_gives_up_before_the_first_step_goes_on_standing() -> None:
    mpc = make_mpc(mpc={"stop_ticks": 1})
    controller = unbundled(MpcController(mpc, np.zeros((2, 3)), FEET, []))
    context = controller.CreateDefaultContext()
    ends = []
    for tick, measured in ((0, np.zeros(6)), (1, np.full(6, np.nan)), (2, np.zeros(6))):
        controller.GetInputPort("gait_phase").FixValue(context, [tick, 0.0, 0.0])
        controller.GetInputPort("lip_state").FixValue(context, measured)
        update(controller, context)
        ends.append(controller.GetOutputPort("stance_plan").Eval(context).reshape(4, 2)[2:])
    assert controller.GetOutputPort("last_step").Eval(context)[0] == 1.0
    # The second coming stance was to be one foot, and is now the middle between both.
    assert abs(ends[0][1, 1]) > 0.05
    np.testing.assert_allclose(ends[2][1, 1], 0.0, atol=1e-6)


def test_controller_is_a_function_of_its_context() -> None:
    controller, context = _controller()
    copy = context.Clone()
    for c in (context, copy, context, copy):
        update(controller, c)
    plans = [controller.GetOutputPort("com_reference").Eval(c) for c in (context, copy)]
    np.testing.assert_array_equal(plans[0], plans[1])


def test_a_measurement_with_nan_is_replaced_by_the_prediction_and_reported() -> None:
    controller, context = _controller()
    update(controller, context)
    blind = context.Clone()
    for c, lip in ((context, np.zeros(6)), (blind, np.full(6, np.nan))):
        controller.GetInputPort("gait_phase").FixValue(c, [1.0, 0.0, 0.0])
        controller.GetInputPort("lip_state").FixValue(c, lip)
        update(controller, c)
    reasons = [controller.GetOutputPort("solver_status").Eval(c)[5] for c in (context, blind)]
    assert reasons == [Reason.SOLVED, Reason.BAD_MEASUREMENT]
    assert np.all(np.isfinite(controller.GetOutputPort("com_reference").Eval(blind)))


def test_the_tube_filter_reports_the_slack_of_each_barrier() -> None:
    tube = VanDerPolTube(VanDerPolConfig())
    block = TubeFilter(tube)
    context = block.CreateDefaultContext()
    block.GetInputPort("oscillator_state").FixValue(context, [3.0, 0.0])  # beyond the upper bound of x1
    update(block, context)
    slack = block.GetOutputPort("barrier_slack").Eval(context)
    assert [barrier.name for barrier, by in zip(tube.barriers, slack, strict=True) if by > 1e-6] == [
        "x2_lower",  # no input is slow enough for x1_upper, which comes first and is kept, and fast enough for it
    ]
    status = block.GetOutputPort("solver_status").Eval(context)
    assert status[3] == slack.max()
    assert status[5] == Reason.SOFTENED


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
        reference = feet.GetOutputPort("foot_reference").Eval(context).reshape(2, 3, 3)[swinging]
        time = (tick - config.double_support_ticks) * config.tick
        np.testing.assert_allclose(
            reference, swing_point(*plan[swinging], config.swing_height, duration, time), atol=1e-9
        )
        update(feet, context)


def test_a_push_acts_from_its_first_to_its_last_tick() -> None:
    force = TimedForce(BodyIndex(1), np.array([0.0, 0.0, 0.1]), np.array([5.0, 0.0, 0.0]), 3, 5)
    block = PushSchedule([force], 0.01)
    simulator = Simulator(block)
    context = simulator.get_context()
    forces = []
    for tick in range(7):
        simulator.AdvanceTo(0.01 * tick + 0.005)
        applied: list[ExternallyAppliedSpatialForce] = block.GetOutputPort("applied_spatial_force").Eval(context)
        assert len(applied) == (tick in (3, 4))
        for entry in applied:
            assert entry.body_index == force.body
            np.testing.assert_array_equal(entry.p_BoBq_B, force.point)
            np.testing.assert_array_equal(entry.F_Bq_W.translational(), force.force)
            np.testing.assert_array_equal(entry.F_Bq_W.rotational(), 0.0)
        forces.append(block.GetOutputPort("push").Eval(context)[0])
    assert forces == [0, 0, 0, 5, 5, 0, 0]


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
