"""The ZMP offset of the swinging legs: learned for each tick of the step, and predicted by the lever."""

import numpy as np
import pytest
from contexts import update

from pdhocbf_drake.systems.zmp_offset import ZmpOffset
from pdhocbf_drake.walking import Gait, GaitConfig, swing_point

GAIT = Gait(GaitConfig())
FEET = np.array([[0.0, 0.08], [0.0, -0.08]])


def test_offset_is_learned_per_tick_of_the_step_and_mirrored() -> None:
    block = ZmpOffset(GAIT, 80)
    context = block.CreateDefaultContext()
    for _ in range(60):
        block.GetInputPort("gait_phase").FixValue(context, [10.0, 3.0, 1.0])
        block.GetInputPort("zmp_reference").FixValue(context, [1.0, 0.0, 0.1, 0.0])
        block.GetInputPort("whole_body_zmp").FixValue(context, [1.02, 0.11])
        update(block, context)
    block.GetInputPort("gait_phase").FixValue(context, [9.0, 3.0, 1.0])
    x, y = block.GetOutputPort("zmp_offset").Eval(context).reshape(2, 80)
    np.testing.assert_allclose([x[0], x[40], y[0], y[40]], [0.02, 0.02, 0.01, -0.01], atol=1e-9)
    assert np.count_nonzero(np.abs(x) > 1e-12) == 2
    block.GetInputPort("whole_body_zmp").FixValue(context, [np.nan, 5.0])
    update(block, context)
    assert np.all(np.isfinite(block.GetOutputPort("zmp_offset").Eval(context)))


def test_offset_learned_on_one_foot_is_the_mirror_of_that_learned_on_the_other() -> None:
    block = ZmpOffset(GAIT, 80)
    tables = []
    for support in (1.0, -1.0):
        context = block.CreateDefaultContext()
        block.GetInputPort("gait_phase").FixValue(context, [10.0, 3.0, support])
        block.GetInputPort("zmp_reference").FixValue(context, [1.0, 0.0, 0.1 * support, 0.0])
        block.GetInputPort("whole_body_zmp").FixValue(context, [1.02, 0.11 * support])
        update(block, context)
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
def test_offset_of_a_swinging_leg_is_predicted_by_its_lever_and_not_learned(support: float) -> None:
    """What the whole body's ZMP shows of the swing is what was expected of it, so that nothing is left to the table.

    Predicted are the rest of this step and the next one, in which the other foot swings to the stance after the coming.
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
    offset = lever * at(10)[swinging, 2, :2]
    block.GetInputPort("whole_body_zmp").FixValue(context, offset)
    update(block, context)
    np.testing.assert_allclose(context.get_discrete_state_vector().value(), 0.0, atol=1e-15)  # type: ignore[attr-defined]
    predicted = block.GetOutputPort("zmp_offset").Eval(context).reshape(2, 80)
    wanted = [at(tick)[swinging, 2] for tick in range(11, 40)] + [next_step(tick) for tick in range(40)]
    np.testing.assert_allclose(predicted[:, :69].T, lever * np.array(wanted)[:, :2], atol=1e-9)
    assert np.all(np.abs(offset) > 1e-4)
