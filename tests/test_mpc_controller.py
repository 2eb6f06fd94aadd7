"""The periodic MPC (36): its program, its rows, its closed loop on the template, and what it does when it can't."""

import numpy as np
import pytest
from pydrake.solvers import ClarabelSolver, Solve
from walks import make_mpc, predicted, repacked, speed_limit, start, walk

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc import orbit
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.memory_layout import MemoryLayout
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.mpc.terms.stability import Stability
from pdhocbf_drake.simulation.build import nominal_walk_of
from pdhocbf_drake.simulation.scenario_file import load_scenario

PLAIN = make_mpc()


def test_the_horizon_must_hold_whole_gaits() -> None:
    with pytest.raises(InputError) as error:
        make_mpc(mpc={"horizon": 120})
    assert str(error.value) == (
        "mpc.horizon: Lemma 2 needs a multiple of the gait's 80 ticks (two steps), such as 80 or 160 (given: 120)"
    )


def test_every_constraint_and_cost_has_a_name() -> None:
    mpc = make_mpc(barriers=(speed_limit(0.5),))
    program = mpc.problems[0].write(3)
    bindings = [*program.prog.GetAllConstraints(), *program.prog.GetAllCosts()]
    names = {binding.evaluator().get_description() for binding in bindings}
    assert names == {
        "effort", "foothold", "slack", "zmp_box_lower", "zmp_box_upper", "step_lower", "step_upper",
        "stability", "barrier limit", "slack limit",
    }  # fmt: skip


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("tick", [0, 79, 95, 160, 163, 199])
def test_the_program_solved_by_drake_is_what_the_controller_plans(axis: int, tick: int) -> None:
    """The readable program with its parameters fixed, through a stock solver, against the compiled one."""
    mpc = make_mpc(barriers=(speed_limit(0.385),))
    for k, state, stance, plan in walk(mpc, tick + 1):  # noqa: B007
        if k == tick:
            break
        last = plan
    program = mpc.problems[axis].write(tick % 40)
    bounds = {"limit": np.full(81, 0.385)}
    theta = mpc.problems[axis].theta(mpc.given(tick, state, stance, bounds, None, last if tick else None))
    program.prog.AddBoundingBoxConstraint(theta, theta, program.parameters)
    result = Solve(program.prog) if axis == 1 else ClarabelSolver().Solve(program.prog)
    assert result.is_success()
    w = result.GetSolution(program.decisions)
    np.testing.assert_allclose(w[:80], plan.inputs[axis], atol=2e-4)
    np.testing.assert_allclose(w[80:82], plan.footholds[axis], atol=1e-6)


def test_zmp_stays_in_its_box_and_the_stability_row_holds_in_every_prediction() -> None:
    mpc = PLAIN
    for tick, state, stance, plan in walk(mpc, 300):
        assert plan.reason == Reason.SOLVED
        future = predicted(mpc, state, plan)
        low, high = mpc.zmp_box(tick + 1, stance, plan.footholds).T
        assert np.all(future[:, 1, 2] >= low - 1e-9)
        assert np.all(future[:, 1, 2] <= high + 1e-9)
        if not mpc.commanded.steps(tick // 40).repeats:
            continue
        for axis in (0, 1):
            first = mpc.divergent.offset_row(tick) @ future[axis, 0]
            end = mpc.divergent.offset_row(tick + 80) @ future[axis, -1]
            assert end == pytest.approx(first, abs=1e-8)


@pytest.mark.parametrize(("side", "margin"), [(1.0, 0.0), (-1.0, 0.005)])
def test_the_real_zmp_stays_in_its_box_where_it_is_expected_to_differ(side: float, margin: float) -> None:
    """A ZMP that lies 2 cm ahead of the template's, or behind it, in every predicted box, the margin inside."""
    mpc, tick = make_mpc(mpc={"zmp_margin": margin}), 205
    memory = start(mpc)
    last = list(walk(mpc, tick, memory))[-1][3]
    offset = side * np.array([0.02 * np.ones(80), 0.01 * np.ones(80)])
    plan = mpc.solve(tick, memory.state, memory.stance, {}, offset, last)
    assert plan.reason == Reason.SOLVED
    zmp = predicted(mpc, memory.state, plan)[:, 1:, 2] + offset
    weights, feet = mpc.gait.region.weights(tick % 40, 80, 2), np.hstack([memory.stance, plan.footholds])
    half = np.array(mpc.gait.config.zmp_box)[:, None] / 2.0 - margin
    beyond = np.abs(zmp - feet @ weights.T) - half
    assert beyond.max() < 1e-9
    assert beyond[0].max() > -1e-6  # and it comes to the edge, so that an offset of the other sign would show
    low, high = mpc.zmp_box(tick + 1, memory.stance, plan.footholds).T
    np.testing.assert_allclose(high - low, mpc.gait.config.zmp_box)  # the box that is told has no margin


@pytest.mark.parametrize(
    ("axis", "sway", "price"), [(0, None, 30.0), (1, None, 30.0), (0, 70.0, 30.0), (1, 70.0, 70.0)]
)
def test_the_zmp_is_priced_by_its_squared_distance_from_the_middle_of_its_box(
    axis: int, sway: float | None, price: float
) -> None:
    """The ZMP of all links, offset included, for any inputs, feet and state; in y at a price of its own."""
    horizon, phase = 80, 13
    problem = make_mpc(mpc={"zmp_centre_weight": 30.0, "sway_weight": sway}).problems[axis]
    program = problem.write(phase)
    costs = {cost.evaluator().get_description(): cost for cost in program.prog.GetAllCosts()}
    values = np.random.default_rng(2).normal(size=program.prog.num_vars())
    u, f, theta = np.split(values, [horizon, horizon + 2])
    part = {name: theta[place] for name, place in problem.places.items()}
    zmp = part["state"][2] + PLAIN.vhip.tick * np.cumsum(u) + part["zmp_offset"]
    middle = PLAIN.gait.region.weights(phase, horizon, 2) @ np.concatenate([part["stance"], f])
    told = program.prog.EvalBinding(costs["zmp_centre"], values)
    np.testing.assert_allclose(told, price * np.sum((zmp - middle) ** 2))


@pytest.mark.parametrize(("phase", "held"), [(20, False), (33, False), (34, True), (39, True)])
def test_a_landing_is_held_in_the_last_ticks_of_a_step(phase: int, held: bool) -> None:
    mpc, tick = make_mpc(mpc={"freeze_ticks": 6}), 200 + phase
    memory = start(mpc)
    last = list(walk(mpc, tick, memory))[-1][3]
    plan = mpc.solve(tick, memory.state + np.array([0.0, 0.05, 0.0]), memory.stance, {}, None, last)
    assert plan.reason == Reason.SOLVED
    moved = np.abs(plan.footholds[:, 0] - last.footholds[:, 0])
    assert np.all(moved < 1e-9) if held else np.all(moved > 1e-4)


def stability(mpc: PeriodicMpc, axis: int) -> Stability:
    return next(term for term in mpc.problems[axis].terms if isinstance(term, Stability))


@pytest.mark.parametrize("tail", ["truncated", "anticipative"])
def test_other_tails_end_where_they_say(tail: str) -> None:
    mpc = make_mpc(mpc={"tail": tail})
    for tick, state, _, plan in walk(mpc, 200):
        end = mpc.divergent.offset_row(tick + 80) @ predicted(mpc, state, plan)[0, -1]
        discount = mpc.divergent.discounts(tick, 80)[-1]
        wanted = 0.0 if tail == "truncated" else stability(mpc, 0).anticipative_tail(tick) / discount
        assert end == pytest.approx(wanted, abs=1e-8)


def test_anticipative_tail_is_brute_force_summation_of_the_commanded_zmp() -> None:
    mpc, tick = PLAIN, 207
    weight, period = mpc.gait.region.weight, mpc.gait.period

    def centre(k: int) -> np.ndarray:
        step, phase = divmod(k, period)
        before, now = mpc.gait.foothold(step - 1), mpc.gait.foothold(step)
        return before + weight[phase] * (now - before)

    velocity = [(centre(k + 1) - centre(k)) / 0.01 for k in range(tick, tick + 2000)]
    brute = mpc.divergent.input_weights(tick, 2000)[80:] @ np.array(velocity)[80:]
    ours = [stability(mpc, axis).anticipative_tail(tick) for axis in (0, 1)]
    np.testing.assert_allclose(ours, brute, atol=1e-9)


@pytest.mark.parametrize(("period", "horizon"), [(10, 20), (10, 80), (40, 80)])
def test_the_anticipative_tail_is_that_of_the_whole_walk_ahead(period: int, horizon: int) -> None:
    gait = {"ticks_per_step": period, "double_support_ticks": 2, "com_height_amplitude": 0.0, "stride": 0.1}
    mpc = make_mpc(gait, {"horizon": horizon, "tail": "anticipative"})
    weight = mpc.gait.region.weight
    for tick in (0, 3 * period + 3):
        steps, phases = np.divmod(np.arange(tick, tick + 3001), period)
        feet = np.array([mpc.gait.foothold(j) for j in range(-1, steps[-1] + 1)])
        centre = feet[steps] + weight[phases, None] * (feet[steps + 1] - feet[steps])
        brute = mpc.divergent.input_weights(tick, 3000)[horizon:] @ np.diff(centre, axis=0)[horizon:] / 0.01
        ours = [stability(mpc, axis).anticipative_tail(tick) for axis in (0, 1)]
        np.testing.assert_allclose(ours, brute, atol=1e-9)


def test_the_walk_settles_into_an_orbit_with_the_commanded_speed() -> None:
    rows = [(state[0, 1], stance[0, 1]) for _, state, stance, _ in walk(PLAIN, 1000)]
    velocity, stance = np.array(rows).T
    assert np.abs(velocity[-40:] - velocity[-80:-40]).max() < 1e-3
    assert velocity[-40:].mean() == pytest.approx(0.15 / 0.4, rel=0.01)
    assert stance[-1] - stance[-81] == pytest.approx(0.3, rel=0.01)


def test_a_binding_barrier_is_kept_and_slows_the_walk() -> None:
    limit = 0.36  # below the mean of the nominal orbit
    mpc = make_mpc(barriers=(speed_limit(limit),))
    rows = [(state[0, 1], plan.slack) for _, state, _, plan in walk(mpc, 500)]
    velocity, slack = np.array(rows).T
    assert velocity.max() <= limit + 1e-9 + slack.max()
    assert velocity.max() > limit - 0.01
    assert slack.max() < 1e-6


def test_a_soft_barrier_that_cannot_be_kept_is_paid_for_and_said() -> None:
    mpc = make_mpc(barriers=(speed_limit(0.4),))
    plans = [plan for *_, plan in walk(mpc, 230, kick={220: np.array([0.25, 0.0])})]
    assert plans[221].reason == Reason.SOFTENED
    assert plans[221].slack > 1e-3
    assert plans[220].reason == Reason.SOLVED


def test_a_hard_barrier_that_cannot_be_kept_degrades_and_never_raises() -> None:
    mpc = make_mpc(mpc={"barrier": "hard"}, barriers=(speed_limit(0.4),))
    plans = [plan for *_, plan in walk(mpc, 240, kick={220: np.array([0.25, 0.0])})]
    assert all(np.all(np.isfinite(plan.inputs)) for plan in plans)
    assert all(plan.reason == Reason.SOLVED for plan in plans[:221])
    assert plans[221].reason != Reason.SOLVED


def test_a_start_in_motion_is_told_as_it_is() -> None:
    state = np.array([[0.1, 0.3, 0.05], [0.02, -0.1, 0.03]])
    memory = Memory.at_start(PLAIN, state, np.array([[0.0, 0.08], [0.0, -0.08]]))
    eta = PLAIN.vhip.eta[0]
    np.testing.assert_allclose(memory.com_reference, [0.1, 0.3, eta * 0.05, 0.02, -0.1, -eta * 0.01])
    np.testing.assert_allclose(memory.zmp_reference, [0.05, 0.0, 0.03, 0.0])


def test_the_acceleration_told_is_the_one_that_the_template_will_have() -> None:
    """Of tick k + 1, hence with its eta and its sign: v moves by δ times it in the tick after."""
    mpc = make_mpc(gait={"com_height_amplitude": 0.015})
    memory = start(mpc)
    told = [memory.com_reference.reshape(2, 3)[:, [1, 2]] for _ in walk(mpc, 130, memory)]
    velocity, acceleration = np.array(told)[1:].transpose(2, 0, 1)
    np.testing.assert_allclose(np.diff(velocity, axis=0), mpc.vhip.tick * acceleration[:-1], atol=1e-12)
    assert np.abs(acceleration).max() > 0.1


def test_memory_survives_packing() -> None:
    mpc = PLAIN
    memory = start(mpc)
    list(walk(mpc, 130, memory))
    layout = MemoryLayout(mpc)
    vector = layout.pack(memory)
    copy = layout.unpack(vector)
    np.testing.assert_array_equal(layout.pack(copy), vector)
    assert copy.plan is not None
    assert memory.plan is not None
    assert copy.plan.tick == memory.plan.tick
    for name in ("measured", "state", "feet", "stance"):
        np.testing.assert_array_equal(getattr(copy, name), getattr(memory, name))
        np.testing.assert_array_equal(vector[layout.places[name]], getattr(memory, name).ravel())
    for name in ("inputs", "footholds"):
        np.testing.assert_array_equal(getattr(copy.plan, name), getattr(memory.plan, name))
        np.testing.assert_array_equal(vector[layout.places[name]], getattr(memory.plan, name).ravel())
    assert repacked(mpc, start(mpc)).plan is None


def test_a_landed_foot_is_taken_where_it_is_measured() -> None:
    mpc = PLAIN
    memory = start(mpc)
    list(walk(mpc, 120, memory))  # tick 120 opens the second step; the left foot has just come down
    measured = memory.feet + 0.01
    memory.land(mpc, 120, measured)
    np.testing.assert_allclose(memory.feet[0], measured[0])
    np.testing.assert_allclose(memory.stance[:, 1], measured[0])
    before = memory.feet.copy()
    memory.land(mpc, 121, measured + 1.0)  # not a touchdown
    memory.land(mpc, 120, np.full((2, 3), np.nan))
    np.testing.assert_array_equal(memory.feet, before)


def test_the_stances_shown_at_a_new_step_are_those_planned_and_then_as_commanded() -> None:
    memory, step = start(PLAIN), 6
    *_, (_, _, stance, plan) = walk(PLAIN, step * 40, memory)
    last, this, *coming = memory.stance_plan.reshape(4, 2)
    np.testing.assert_array_equal([last, this], [stance[:, 1], plan.footholds[:, 0]])
    np.testing.assert_array_equal(coming[0], plan.footholds[:, 1])
    commanded = PLAIN.gait.foothold(step + 2) - PLAIN.gait.foothold(step + 1)
    np.testing.assert_allclose(coming[1] - coming[0], commanded, atol=1e-12)
    # The foot that swings goes from where it stood to the first coming stance, and the other one rests.
    swinging = 1 if PLAIN.gait.support(step) > 0 else 0
    ways = memory.foot_plan.reshape(2, 2, 2)
    np.testing.assert_array_equal(ways[swinging], [stance[:, 1], coming[0]])
    np.testing.assert_array_equal(ways[1 - swinging], [this, this])


@pytest.mark.parametrize(
    ("name", "shape"), [("offset", (2, 90)), ("offset", (2, 10)), ("state", (2, 2)), ("stance", (2, 1))]
)
def test_what_has_another_shape_is_refused_before_machine_code_sees_it(name: str, shape: tuple[int, int]) -> None:
    given = {"state": np.zeros((2, 3)), "stance": np.zeros((2, 2)), "offset": np.zeros((2, 80)), name: np.zeros(shape)}
    with pytest.raises(ValueError, match=r"must have shapes \(\(2, 3\), \(2, 2\), \(2, 80\)\), given"):
        PLAIN.solve(40, given["state"], given["stance"], {}, given["offset"])


def test_the_orbit_is_found_with_the_less_exact_solver_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(orbit, "_GAITS", 12)  # far more than it takes, far fewer than its noise can be waited out for
    text = "{gait: {ticks_per_step: 20, tick: 0.02}, mpc: {horizon: 40, solver: %s}}"
    exact, other = (nominal_walk_of(load_scenario("walking", text % solver), 0.15) for solver in ("daqp", "clarabel"))
    np.testing.assert_allclose(other[:, :, 1], exact[:, :, 1], atol=1e-5)
