"""Recovery: the limits that a disturbed walk may use, and when it begins and ends."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from walks import make_mpc, repacked, start

from pdhocbf_drake.mpc.axis_problem import AxisProblem
from pdhocbf_drake.mpc.config import MpcConfig, RecoveryConfig
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.loop import Measurement, control
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.memory_layout import MemoryLayout
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.mpc.recovery import CALM, Disturbance
from pdhocbf_drake.walking import Gait, GaitConfig
from pdhocbf_drake.walking.vhip import Vhip

RECOVERY = RecoveryConfig(zmp_box=(0.18, 0.11))
SETTLED = 480  # [ticks], a multiple of the gait


@pytest.fixture(scope="module")
def mpc() -> PeriodicMpc:
    return make_mpc({"stride": 0.1}, {"recovery": RECOVERY})


@pytest.fixture(scope="module")
def settled(mpc: PeriodicMpc) -> Memory:
    memory = start(mpc)
    for tick in range(SETTLED):
        advance(mpc, memory, tick)
    return memory


def advance(mpc: PeriodicMpc, memory: Memory, tick: int, kick: np.ndarray | None = None):  # type: ignore[no-untyped-def]
    """One tick as the controller does it; gives the plan."""
    state = memory.state.copy()
    if kick is not None:
        state[:, 1] += kick
    following, plan = control(mpc, memory, Measurement(tick, state))
    vars(memory).update(vars(following))
    return plan


def test_an_undisturbed_walk_is_never_recovered(mpc: PeriodicMpc, settled: Memory) -> None:
    memory = settled.copy()
    for tick in range(SETTLED, SETTLED + 80):
        assert not advance(mpc, memory, tick).recovering
    plain = make_mpc({"stride": 0.1})
    without = plain.solve(SETTLED, settled.state, settled.stance, {}, None, settled.plan)
    np.testing.assert_allclose(memory.state[0, 1], settled.state[0, 1], atol=1e-4)
    own = mpc.solve(SETTLED, settled.state, settled.stance, {}, None, settled.plan)
    np.testing.assert_array_equal(own.inputs, without.inputs)


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 79), st.floats(-0.4, 0.4), st.floats(-0.2, 0.2))
def test_footholds_of_a_recovery_lie_in_reach_on_their_own_side(
    mpc: PeriodicMpc, settled: Memory, phase: int, x: float, y: float
) -> None:
    memory = settled.copy()
    for tick in range(SETTLED, SETTLED + phase):
        advance(mpc, memory, tick)
    kick: np.ndarray | None = np.array([x, y])
    for tick in range(SETTLED + phase, SETTLED + phase + 60):
        stance, side = memory.stance[:, 1].copy(), mpc.gait.support(tick // 40)
        plan = advance(mpc, memory, tick, kick)
        kick = None
        if not plan.recovering:
            continue
        assert plan.reason == Reason.RECOVERING
        feet = np.column_stack([stance, plan.footholds])
        moves = np.diff(feet, axis=1)
        apart = moves[1] * [-side, side]
        assert np.all(np.abs(moves[0]) <= RECOVERY.step_reach[0] + 1e-6)
        # The first foothold may be held where it was last planned; both stay on their own side.
        assert np.all(apart >= min(RECOVERY.stance_width_min, mpc.config.stance_width_min) - 1e-6)
        assert np.all(apart <= RECOVERY.step_reach[1] + 1e-6)


def test_a_kick_is_noticed_at_once_recovered_from_and_then_forgotten(mpc: PeriodicMpc, settled: Memory) -> None:
    memory = settled.copy()
    first = advance(mpc, memory, SETTLED + 0, np.array([0.3, 0.0]))
    assert first.recovering
    plans = [advance(mpc, memory, tick) for tick in range(SETTLED + 1, SETTLED + 600)]
    assert not plans[-1].recovering
    spoken = [plan.recovering for plan in plans]
    assert np.count_nonzero(np.diff(np.array(spoken, dtype=int))) == 1, "it ends once and does not begin again"
    orbit = settled.state[0, 1]
    assert abs(memory.state[0, 1] - orbit) < 1e-4  # fifteen steps later, at the same tick of a step


def test_a_landing_moves_no_farther_than_its_swing_foot_can(mpc: PeriodicMpc, settled: Memory) -> None:
    memory = settled.copy()
    advance(mpc, memory, SETTLED, np.array([0.05, 0.0]))
    memory.disturbance = Disturbance(np.zeros(2), True, 0)
    last = None
    for tick in range(SETTLED + 1, SETTLED + 40):
        plan = advance(mpc, memory, tick, np.array([0.05, -0.01]))
        phase = tick % 40
        left = 40 - phase - RECOVERY.freeze_ticks
        if last is not None and phase > mpc.gait.config.double_support_ticks and plan.recovering:
            room = RECOVERY.swing_acceleration / 10.0 * (max(left, 0) * 0.01) ** 2
            assert abs(plan.footholds[:, 0] - last).max() <= room + 1e-6
        last = plan.footholds[:, 0]


def test_prediction_errors_add_up_and_are_forgotten() -> None:
    state, small = CALM, np.array([0.0005, 0.0])
    np.testing.assert_array_equal(state.after(RECOVERY, 40, small).error_sum, small)
    for _ in range(200):
        state = state.after(RECOVERY, 40, small)
    assert not state.active  # a steady error of half a millimetre a tick is not a disturbance
    state = state.after(RECOVERY, 40, np.array([0.0, 0.02]))
    assert state.active
    quiet = 0
    while not state.may_be_over(RECOVERY):
        state = state.after(RECOVERY, 40, np.zeros(2))
        quiet = quiet + 1 if max(map(abs, state.error_sum)) <= RECOVERY.noticed else 0
    assert quiet == RECOVERY.calm_ticks
    assert state.active  # until the steady program has a plan
    assert not state.ended().active


def test_a_memory_keeps_its_disturbance(mpc: PeriodicMpc, settled: Memory) -> None:
    memory = settled.copy()
    advance(mpc, memory, SETTLED, np.array([0.0, 0.2]))
    again = repacked(mpc, memory)
    assert again.disturbance.active
    assert again.plan is not None
    assert again.plan.recovering
    layout = MemoryLayout(mpc)
    np.testing.assert_array_equal(layout.pack(again), layout.pack(memory))


def test_a_changed_stride_holds_in_recovery_and_in_endings() -> None:
    gait = Gait(GaitConfig(stride=0.15)).with_stride(0.16, 30)
    vhip = Vhip(gait.height.eta(), gait.config.tick)
    mpc = PeriodicMpc(gait, vhip, MpcConfig(recovery=RECOVERY), ([], []), on_demand=True)
    assert mpc.recovery is not None
    for walk in (mpc, mpc.recovery, mpc.ending_at(45), mpc.recovery.ending_at(45)):
        assert walk.gait.foothold(40)[0] == pytest.approx(5.80, abs=1e-12)
        np.testing.assert_allclose(walk.commanded.steps(40).moves[0], 0.16)
    np.testing.assert_array_equal(mpc.recovery.gait.region.half(gait.support(40)), np.array(RECOVERY.zmp_box) / 2.0)


def test_an_infeasible_plan_is_recovered_from(mpc: PeriodicMpc, settled: Memory) -> None:
    state = settled.state.copy()
    state[0, 1] += 0.6
    plain = make_mpc({"stride": 0.1})
    assert plain.solve(SETTLED, state, settled.stance, {}, None, settled.plan._replace()).reason == Reason.RELAXED
    plan = mpc.solve(SETTLED, state, settled.stance, {}, None, settled.plan)
    assert plan.recovering
    assert plan.reason == Reason.NO_STEADY_PLAN
    # It steps farther than a steady walk may: that limit is named, of that axis alone, by as much as it is exceeded.
    step = plan.footholds[0, 0] - settled.stance[0, 1]
    beyond = step - (0.1 + mpc.config.step_tolerance[0])
    assert beyond > 0.01
    assert plan.unmet[0, list(mpc.constraints).index("step")] == pytest.approx(beyond, abs=1e-9)
    assert not plan.unmet[1].any()


def test_a_noticed_disturbance_is_no_program_without_a_solution(mpc: PeriodicMpc, settled: Memory) -> None:
    plan = advance(mpc, settled.copy(), SETTLED, np.array([0.3, 0.0]))
    assert plan.reason == Reason.RECOVERING
    assert not plan.unmet.any()


def test_the_recovery_is_compiled_on_demand_and_plans_the_same(
    settled: Memory, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled: list[int] = []
    inner = AxisProblem.compile

    def counted(problem: AxisProblem, phase: int):  # type: ignore[no-untyped-def]
        if problem.setting.config.stability == "paid":
            compiled.append(phase)
        return inner(problem, phase)

    monkeypatch.setattr(AxisProblem, "compile", counted)
    plans = []
    for prepared in (False, True):
        mpc = make_mpc({"stride": 0.1}, {"recovery": RECOVERY})
        assert set(compiled) == {0}  # which determines the number of rows
        if prepared:
            mpc.prepare()
            assert set(compiled) == set(range(mpc.gait.period))
        plans.append(mpc.solve(SETTLED + 7, settled.state, settled.stance, {}, None, settled.plan, recovering=True))
        assert plans[-1].reason == Reason.RECOVERING
        if not prepared:
            assert set(compiled) == {0, 6, 7}  # and the phase before, whose active set is the first guess
        compiled.clear()
    np.testing.assert_array_equal(plans[0].inputs, plans[1].inputs)
    np.testing.assert_array_equal(plans[0].footholds, plans[1].footholds)
