"""What the controller does when it can't do what it should: each rung of the ladder, and coming to a stand."""

import numpy as np
import pytest
from walks import make_mpc, predicted, repacked, speed_limit, start, walk

from pdhocbf_drake.barriers import AffineBarrier, Linear, constant
from pdhocbf_drake.mpc.commanded import Commanded
from pdhocbf_drake.mpc.config import RecoveryConfig
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.loop import Measurement, control, walk_template
from pdhocbf_drake.mpc.memory_layout import MemoryLayout
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.mpc.terms import TERMS
from pdhocbf_drake.mpc.terms.step_limits import StepLimits
from pdhocbf_drake.mpc.terms.zmp_box import ZmpBox
from pdhocbf_drake.qp import QpResult

BLIND = np.full((2, 3), np.nan)


def loop(mpc: PeriodicMpc, ticks: int, sensor=lambda tick, state: state):
    """The template under the whole controller; `sensor` may lie. Gives states, reasons and the last memory."""

    def measured(true: Measurement) -> Measurement:
        return true._replace(state=np.array(sensor(true.tick, true.state), dtype=float))

    rows = list(walk_template(mpc, start(mpc), 0, ticks, sensor=measured))
    return np.array([row.state for row in rows]), [row.plan.reason for row in rows], rows[-1].memory


def failing(solve_every: int):
    """A solver that gives an answer only every so many calls."""
    calls = [0]

    class Fails:
        def __init__(self, inner) -> None:
            self.inner = inner

        def solve(self, theta: np.ndarray, guess: np.ndarray | None = None) -> QpResult:
            calls[0] += 1
            result = self.inner.solve(theta, guess)
            return result if calls[0] % solve_every == 0 else result._replace(ok=False, infeasible=False)

    return Fails


def test_a_state_beyond_rescue_misses_its_tail_by_as_little_as_it_can() -> None:
    mpc = make_mpc()
    memory = start(mpc)
    last = list(walk(mpc, 220, memory))[-1][3]
    lost = memory.state.copy()
    lost[0, 1] += 2.0  # [m/s]: no ZMP in any box, no foothold within reach brings this back
    plan = mpc.solve(220, lost, memory.stance, {}, None, last)
    assert plan.reason == Reason.RELAXED
    assert plan.reason.planned
    assert plan.fallbacks == 0
    zmp = predicted(mpc, lost, plan)[:, 1, 2]
    low, high = mpc.zmp_box(221, memory.stance, plan.footholds).T
    assert np.all(zmp >= low - 1e-9)
    assert np.all(zmp <= high + 1e-9)
    assert zmp[0] == pytest.approx(high[0], abs=1e-6)  # all the braking there is
    step = plan.footholds[0, 0] - memory.stance[0, 1]
    assert step == pytest.approx(0.15 + mpc.config.step_tolerance[0], abs=1e-6)  # the longest step allowed
    # What is told of it: the stability row of x, by as much as the tail is missed, and nothing of y.
    missed = mpc.divergent.input_weights(220, 80) @ plan.inputs[0] - mpc.divergent.offset_row(220) @ lost[0]
    missed += mpc.divergent.discounts(220, 80)[-1] * (mpc.divergent.offset_row(220) @ lost[0])
    np.testing.assert_allclose(plan.unmet, [[abs(missed), 0.0, 0.0], [0.0, 0.0, 0.0]], rtol=1e-9)
    assert abs(missed) > 0.01


def test_a_hard_barrier_that_cannot_be_kept_is_softened() -> None:
    mpc = make_mpc(mpc={"barrier": "hard"}, barriers=(speed_limit(0.4),))
    plans = [plan for *_, plan in walk(mpc, 260, kick={220: np.array([0.2, 0.0])})]
    assert plans[220].reason == Reason.SOLVED
    assert plans[221].reason == Reason.SOFTENED
    assert plans[221].slack > 1e-3
    assert plans[-1].reason == Reason.SOLVED


def wall(position: float) -> AffineBarrier:
    """A limit on where the CoM is, which the ZMP velocity reaches three ticks later and not two."""
    return AffineBarrier("wall", [1.0, 0.0, 0.0], constant(position), 1, [Linear(0.5)] * 3, "m")


@pytest.mark.parametrize("barrier", ["soft", "hard"])
@pytest.mark.parametrize("gives_way", [0, 1])
def test_of_two_barriers_the_one_that_gives_way_has_the_slack(barrier: str, gives_way: int) -> None:
    two = [wall(100.0)]
    two.insert(gives_way, speed_limit(0.4))
    mpc = make_mpc(mpc={"barrier": barrier}, barriers=tuple(two))
    plans = [plan for *_, plan in walk(mpc, 222, kick={220: np.array([0.2, 0.0])})]
    assert not plans[220].slacks.any()
    assert plans[221].reason == Reason.SOFTENED
    assert plans[221].slacks[gives_way] == plans[221].slack > 1e-3
    assert plans[221].slacks[1 - gives_way] == 0.0
    assert not plans[221].unmet.any()


def test_a_hard_barrier_is_softened_before_the_walk_counts_as_disturbed() -> None:
    recovery = {"barrier": "hard", "recovery": RecoveryConfig(zmp_box=(0.18, 0.11))}
    plans = {}
    for kick in (0.2, 0.6):
        mpc = make_mpc({"stride": 0.1}, recovery, (speed_limit(0.4),))
        memory = start(mpc)
        list(walk(mpc, 221, memory))
        state = memory.state + np.array([[0.0, kick, 0.0], [0.0, 0.0, 0.0]])  # which nobody notices
        plans[kick] = mpc.solve(221, state, memory.stance, mpc.bounds(221), None, memory.plan)
    assert plans[0.2].reason == Reason.SOFTENED
    assert not plans[0.2].recovering
    assert plans[0.2].slack > 1e-4
    assert not plans[0.2].unmet.any()
    # Where softening is of no help, the steady walk's own constraints are named.
    assert plans[0.6].reason == Reason.NO_STEADY_PLAN
    assert plans[0.6].recovering
    assert np.all(plans[0.6].unmet[0] > 1e-3)
    assert not plans[0.6].unmet[1].any()


@pytest.mark.parametrize(("constraint", "axis"), [("zmp_box", 0), ("step", 1)])
def test_limits_that_contradict_each_other_are_named_with_their_axis(constraint: str, axis: int) -> None:
    mpc = make_mpc()
    memory = start(mpc)
    last = list(walk(mpc, 220, memory))[-1][3]

    class WrongBox(ZmpBox):
        def fill_step(self, step: int, ahead: Commanded, theta: np.ndarray) -> None:
            super().fill_step(step, ahead, theta)
            if self.axis == axis:
                theta[self.places["half"]] = -0.01

    class WrongSteps(StepLimits):
        def fill_step(self, step: int, ahead: Commanded, theta: np.ndarray) -> None:
            super().fill_step(step, ahead, theta)
            if self.axis == axis:
                theta[self.places["step_lower"]] = theta[self.places["step_upper"]] + 0.03

    right, wrong = {"zmp_box": (ZmpBox, WrongBox), "step": (StepLimits, WrongSteps)}[constraint]
    kinds = [wrong if kind is right else kind for kind in TERMS]
    mpc = PeriodicMpc(mpc.gait, mpc.vhip, mpc.config, mpc.barriers, kinds=kinds)
    plan = mpc.solve(220, memory.state, memory.stance, {}, None, last)
    assert plan.reason == Reason.INFEASIBLE
    assert plan.fallbacks == 1
    told = np.zeros((2, 3))
    told[axis, list(mpc.constraints).index(constraint)] = 0.03 if constraint == "step" else 0.02
    np.testing.assert_allclose(plan.unmet, told, atol=1e-9)


def test_recovery_from_outside_follows_the_class_k_rate_where_the_input_allows() -> None:
    gammas, kick = (0.1, 0.1), 0.06
    mpc = make_mpc(barriers=(speed_limit(0.40, gammas),))
    rows = [(state[0, 1], plan.slack) for _, state, _, plan in walk(mpc, 320, kick={220: np.array([kick, 0.0])})]
    velocity, slack = np.array(rows).T
    h = 0.40 - velocity
    outside = np.flatnonzero(h < 0)
    assert len(outside)
    assert outside[0] >= 221
    free = [k for k in range(221, 300) if slack[k] < 1e-9]
    psi = h[2:] - 1.8 * h[1:-1] + 0.81 * h[:-2]
    assert all(psi[k] >= -1e-9 for k in free)
    assert h[300:].min() > 0


def test_without_any_solution_the_last_plan_is_shifted_within_the_box(monkeypatch: pytest.MonkeyPatch) -> None:
    mpc = make_mpc()
    memory = start(mpc)
    last = list(walk(mpc, 220, memory))[-1][3]
    never = failing(10**9)
    monkeypatch.setattr(mpc, "solvers", [[never(s) for s in axis] for axis in mpc.solvers])
    monkeypatch.setattr(mpc, "rungs", [])
    plan = mpc.solve(220, memory.state, memory.stance, {}, None, last)
    assert plan.reason == Reason.NOT_OPTIMAL
    assert plan.fallbacks == 1
    np.testing.assert_allclose(plan.inputs[:, :-1], last.inputs[:, 1:], atol=1e-9)
    low, high = mpc.zmp_box(221, memory.stance, plan.footholds).T
    zmp = memory.state[:, 2] + 0.01 * plan.inputs[:, 0]
    assert np.all(zmp >= low - 1e-12)
    assert np.all(zmp <= high + 1e-12)
    for way, edge in ((-99.0, low), (99.0, high)):  # a plan that leads out of the box is cut off at its edge
        out = mpc.solve(220, memory.state, memory.stance, {}, None, last._replace(inputs=last.inputs + way))
        np.testing.assert_allclose(memory.state[:, 2] + 0.01 * out.inputs[:, 0], edge, atol=1e-12)
    assert mpc.solve(221, memory.state, memory.stance, {}, None, plan).fallbacks == 2
    fresh = mpc.solve(0, np.zeros((2, 3)), start(mpc).stance, {}, None, None)
    np.testing.assert_array_equal(fresh.inputs, 0.0)


def test_footholds_without_any_solution_are_as_planned_then_as_commanded(monkeypatch: pytest.MonkeyPatch) -> None:
    mpc = make_mpc()
    memory = start(mpc)
    last = list(walk(mpc, 240, memory))[-1][3]
    never = failing(10**9)
    monkeypatch.setattr(mpc, "solvers", [[never(s) for s in axis] for axis in mpc.solvers])
    monkeypatch.setattr(mpc, "rungs", [])
    plan = mpc.solve(240, memory.state, memory.stance, {}, None, last)  # the first tick of a step
    np.testing.assert_array_equal(plan.footholds[:, 0], last.footholds[:, 1])
    commanded = mpc.gait.foothold(240 // 40 + 2) - mpc.gait.foothold(240 // 40 + 1)
    np.testing.assert_allclose(plan.footholds[:, 1] - plan.footholds[:, 0], commanded, atol=1e-12)
    alone = mpc.solve(240, memory.state, memory.stance, {}, None, None)
    steps = [mpc.gait.foothold(240 // 40 + ahead) - mpc.gait.foothold(240 // 40) for ahead in (1, 2)]
    np.testing.assert_allclose(alone.footholds.T - memory.stance[:, 1], steps, atol=1e-12)


def test_a_solver_that_gives_up_is_replaced_by_the_independent_one() -> None:
    mpc = make_mpc()
    honest = [plan.inputs for *_, plan in walk(mpc, 100)]
    mpc = make_mpc()
    sometimes = failing(5)
    mpc.solvers = [[sometimes(s) for s in axis] for axis in mpc.solvers]
    plans = [plan for *_, plan in walk(mpc, 100)]
    assert {plan.reason for plan in plans} == {Reason.CROSS_SOLVED}
    np.testing.assert_allclose([plan.inputs for plan in plans], honest, atol=1e-3)


@pytest.mark.parametrize("ticks", [1, 10])
def test_a_short_blindness_is_walked_through(ticks: int) -> None:
    mpc = make_mpc()
    seen, _, _ = loop(mpc, 400)
    blind, reasons, memory = loop(mpc, 400, lambda k, state: BLIND if 200 <= k < 200 + ticks else state)
    assert reasons[199] == Reason.SOLVED
    assert reasons[200] == Reason.BAD_MEASUREMENT
    assert reasons.count(Reason.BAD_MEASUREMENT) == ticks
    assert memory.last_step < 0
    np.testing.assert_allclose(blind, seen, atol=1e-9)


def test_a_long_blindness_ends_in_a_stand() -> None:
    mpc = make_mpc(mpc={"zmp_centre_weight": 30.0})
    states, reasons, memory = loop(mpc, 900, lambda k, state: BLIND if 200 <= k < 240 else state)
    assert memory.last_step == 219 // 40 + 1
    assert reasons[-1] == Reason.STOPPING
    assert np.abs(states[-1, :, 1]).max() < 0.01  # at rest
    feet = memory.feet
    assert feet[0, 0] == pytest.approx(feet[1, 0], abs=1e-6)  # side by side
    assert feet[0, 1] - feet[1, 1] == pytest.approx(0.16, abs=0.02)
    away = np.abs(states[-1, :, 0] - feet.mean(axis=0))
    assert np.all(away < 0.005)  # in the middle between them


def test_a_frozen_sensor_is_noticed() -> None:
    mpc = make_mpc()
    frozen: dict[int, np.ndarray] = {}

    def sensor(k: int, state: np.ndarray) -> np.ndarray:
        frozen.setdefault(200, state.copy()) if k == 200 else None
        return frozen[200] if 200 <= k < 206 else state

    _, reasons, memory = loop(mpc, 300, sensor)
    assert [k for k, reason in enumerate(reasons) if reason == Reason.STALE_MEASUREMENT] == list(range(201, 206))
    assert memory.last_step < 0


def test_a_measurement_is_moved_on_to_when_its_plan_takes_effect() -> None:
    mpc = make_mpc()
    memory, tick = start(mpc), 7
    measured = np.array([[0.003, 0.04, np.nan], [-0.001, 0.02, np.nan]])
    late, plan = control(mpc, memory, Measurement(tick, measured), latency=mpc.vhip.tick)
    led_on = [mpc.vhip.step(tick, [c, v, p], 0.0) for (c, v, _), p in zip(measured, memory.state[:, 2], strict=True)]
    on_time, same = control(mpc, memory, Measurement(tick, np.array(led_on)))
    assert plan.reason == Reason.SOLVED
    np.testing.assert_allclose(plan.inputs, same.inputs, rtol=1e-9)
    np.testing.assert_allclose(late.state, on_time.state, rtol=1e-12)


def test_standing_still_is_not_a_frozen_sensor() -> None:
    _, reasons, _ = loop(make_mpc(gait={"walk_steps": 1, "start_steps": 1}), 500)
    assert set(reasons) == {Reason.SOLVED}


def test_the_memory_of_a_stop_survives_packing() -> None:
    mpc = make_mpc()
    memory = start(mpc)
    memory.last_step, memory.degraded, memory.measured = 5.0, 3.0, np.arange(4.0)
    copy = repacked(mpc, memory)
    assert (copy.last_step, copy.degraded) == (5.0, 3.0)
    np.testing.assert_array_equal(copy.measured, memory.measured)


@pytest.mark.parametrize("barriers", [(), (speed_limit(0.4), wall(100.0))])
def test_the_memory_of_what_gave_way_survives_packing(barriers: tuple) -> None:
    mpc = make_mpc(barriers=barriers)
    memory = start(mpc)
    list(walk(mpc, 3, memory))
    assert memory.barrier_slack.shape == (len(barriers),)
    assert not memory.barrier_slack.any()
    memory.barrier_slack, memory.unmet = 1.0 + np.arange(len(barriers)), 7.0 + np.arange(6.0)
    copy = repacked(mpc, memory)
    np.testing.assert_array_equal(copy.barrier_slack, memory.barrier_slack)
    np.testing.assert_array_equal(copy.unmet, memory.unmet)
    np.testing.assert_array_equal(copy.solver_status, memory.solver_status)
    layout = MemoryLayout(mpc)
    np.testing.assert_array_equal(layout.pack(copy), layout.pack(memory))


def test_every_reason_says_whether_a_solver_answered() -> None:
    assert {reason for reason in Reason if not reason.planned} == {Reason.INFEASIBLE, Reason.NOT_OPTIMAL}
