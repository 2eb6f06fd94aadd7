"""Barriers on every quantity of a walk: rows against the recursion, orbits, the mirrored walk, walks under them."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from pdhocbf_drake.analysis.barrier_margins import barriers_of, psi_along_log
from pdhocbf_drake.analysis.metrics import compute_metrics
from pdhocbf_drake.barriers import AffineBarrier, Bound, constant, psi_from_h
from pdhocbf_drake.config import parse_config
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.loop import TemplateTick, walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.simulation.build import Walk, build_walk, gait_of, nominal_walk_of
from pdhocbf_drake.simulation.given_bounds import notes_on_bounds
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.studies.shared.stepping_template import is_input_limit, stepping_template
from pdhocbf_drake.walking import CosineHeight, Gait, GaitConfig
from pdhocbf_drake.walking.barrier_config import WalkBarrierConfig
from pdhocbf_drake.walking.quantities import QUANTITIES, Quantity, QuantityName, stance_sides
from pdhocbf_drake.walking.sides import BOTH
from pdhocbf_drake.walking.vhip import Vhip
from pdhocbf_drake.walking.walk_barrier import BoundSamples, WalkBarrier

N, TICKS, SETTLED = 40, 640, 320
GAIT = Gait(GaitConfig())
VHIP = Vhip(CosineHeight(GAIT.config).eta(), GAIT.config.tick)
FREE = "barriers: {forward_speed: null"
ALL = "".join(
    f", on_{name}: {{quantity: {name}, side: {side}, bound: {{kind: orbit, margin: {margin}}}}}"
    for name, side, margin in [
        ("forward_speed", "upper", 0.01), ("lateral_speed", "lower", 0.05), ("com_x", "upper", 0.01),
        ("com_y", "upper", 0.01), ("dcm_x", "lower", 0.02), ("dcm_y", "upper", 0.02), ("zmp_x", "lower", 0.01),
        ("zmp_y", "upper", 0.02),
    ]
)  # fmt: skip


def seen(name: str) -> Quantity:
    """The quantity as `quantity: NAME` means it."""
    return replace(QUANTITIES[name], mirrored=QUANTITIES[name].axis == 1)


def barrier_on(name: str, bound: Bound, gamma: tuple[float, ...] | None = None, side: int = 1) -> WalkBarrier:
    quantity = seen(name)
    rates = gamma or (0.4, 0.6, 0.5)[: quantity.relative_degree]
    normals = quantity.normals_of(VHIP, GAIT.config)
    return WalkBarrier(name, quantity, normals, bound, side, rates, relative_degree=quantity.relative_degree)


def along(walk: Walk, rows: list[TemplateTick], quantity: Quantity) -> np.ndarray:
    states = np.array([row.state[quantity.axis] for row in rows])
    stance = np.array([row.before.stance[quantity.axis, 1] for row in rows])
    ticks = np.array([row.tick for row in rows])
    return quantity.values(states, ticks, walk.vhip, walk.gait.config, stance)


@cache
def walked(text: str) -> tuple[Walk, list[TemplateTick]]:
    walk = build_walk(load_scenario("vhip", text))
    return walk, list(walk_template(walk.mpc, Memory.standing(walk.mpc), 0, TICKS))


def test_every_name_is_a_quantity() -> None:
    assert set(QUANTITIES) == set(QuantityName.__args__)  # type: ignore[attr-defined]


@pytest.mark.parametrize(("kind", "degree"), [("zmp", 1), ("dcm", 2), ("com", 3)])
def test_the_relative_degree_counts_the_zmp_velocity(kind: str, degree: int) -> None:
    for axis in "xy":
        name = f"{kind}_{axis}"
        config = parse_config(WalkBarrierConfig, {"quantity": name, "bound": {"kind": "orbit"}}, "b")
        assert QUANTITIES[name].relative_degree == degree
        assert config.gamma == (0.5,) * degree
        assert config.unit == "m"


@pytest.mark.parametrize("tick", [0, 17, 39, 40, 61])
@pytest.mark.parametrize("name", QUANTITIES)
def test_rows_are_the_recursion_along_a_plan_in_the_world(name: str, tick: int) -> None:
    """Each row against ψ from h = V̄ − q with q computed from state and stance foot at each tick."""
    random, horizon = np.random.default_rng(tick), 80
    barrier = barrier_on(name, Bound(tuple(random.normal(size=N))), side=-1)
    groups = ([barrier], []) if barrier.quantity.axis == 0 else ([], [barrier])
    mpc = PeriodicMpc(GAIT, VHIP, MpcConfig(barrier="hard", recovery=None), groups, on_demand=True)
    axis, first = barrier.quantity.axis, 480 + tick
    u, feet, state = random.normal(size=horizon), random.normal(size=4), random.normal(size=3)
    phi, gamma = VHIP.prediction(first, horizon)
    states, k = phi @ state + gamma @ u, first + np.arange(horizon + 1)
    quantity, stance = barrier.quantity, feet[1 + k // N - first // N]
    h = -(barrier.bound.samples(first, horizon + 1) - quantity.values(states, k, VHIP, GAIT.config, stance))
    order, expected = barrier.order, []
    for last in range(order, horizon + 1):
        begin = last - order
        touchdown = int(N * (k[last] // N) - first)  # h is seen anew there
        if quantity.seen_anew and touchdown > begin:
            begin = touchdown
        expected.append(psi_from_h(h[begin : last + 1], barrier.class_k)[-1])

    problem = mpc.problems[axis]
    qp = problem.compile(first % problem.period)
    theta = np.zeros(problem.size)
    theta[problem.places["state"]], theta[problem.places["stance"]] = state, feet[:2]
    theta[problem.places[f"bound_{name}"]] = barrier.bound.samples(first, horizon + 1)
    _, low, high = qp.vectors(theta)
    value = qp.A @ np.concatenate([u, feet[2:]])
    found = np.minimum(value - low, high - value)[np.array(qp.names) == f"barrier {name}"]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("name", [name for name, quantity in QUANTITIES.items() if quantity.frame == "stance"])
def test_a_coming_foothold_enters_the_rows_from_its_touchdown_on(name: str) -> None:
    barrier = barrier_on(name, constant(0.1))
    groups = ([barrier], []) if barrier.quantity.axis == 0 else ([], [barrier])
    mpc = PeriodicMpc(GAIT, VHIP, MpcConfig(barrier="hard", recovery=None), groups, on_demand=True)
    qp = mpc.problems[barrier.quantity.axis].compile(10)
    on_feet = qp.A[np.array(qp.names) == f"barrier {name}"][:, 80:82]
    last = barrier.order + np.arange(len(on_feet))  # tick of the plan at which a row ends
    np.testing.assert_array_equal(on_feet[:, 0] != 0, (last >= 30) & (last < 70))
    np.testing.assert_array_equal(on_feet[:, 1] != 0, last >= 70)


@pytest.mark.parametrize("name", QUANTITIES)
def test_the_nominal_walk_stays_on_its_orbit(name: str) -> None:
    walk, rows = walked(FREE + "}")
    quantity = seen(name)
    nominal = nominal_walk_of(load_scenario("vhip"), walk.gait.config.stride)
    upper, lower = (quantity.orbit(nominal, walk.vhip, walk.gait.config, side) for side in ("upper", "lower"))
    assert upper is not None
    assert lower is not None
    values = along(walk, rows, quantity)[SETTLED:].reshape(-1, N)
    assert (values - upper).max() < 3e-4
    assert (values - lower).min() > -3e-4


@pytest.mark.parametrize("start_steps", [1, 2, 3, 4])
@pytest.mark.parametrize("mirrored", [True, False])
def test_orbits_across_the_heading_belong_to_the_walk_however_long_it_stood(start_steps: int, mirrored: bool) -> None:
    text = f"{{gait: {{start_steps: {start_steps}}}, {FREE}}}}}"
    walk, rows = walked(text)
    quantity = replace(QUANTITIES["lateral_speed"], mirrored=mirrored)
    nominal = nominal_walk_of(load_scenario("vhip", text), walk.gait.config.stride)
    orbit = quantity.orbit(nominal, walk.vhip, walk.gait.config)
    values = along(walk, rows, quantity)[400:560].reshape(-1, quantity.period(N))
    np.testing.assert_allclose(values, np.tile(orbit, (len(values), 1)), atol=0.003)


def test_the_short_stand_of_an_orbit_leaves_even_steps_on_their_foot() -> None:
    for steps in range(6):
        scenario = load_scenario("vhip", f"gait: {{start_steps: {steps}}}")
        assert stance_sides(gait_of(scenario, 0.1).config) == stance_sides(scenario.gait)


@pytest.mark.parametrize("side", ["upper", "lower"])
@pytest.mark.parametrize("name", QUANTITIES)
def test_a_walk_keeps_a_bound_that_acts(name: str, side: str) -> None:
    free_walk, free = walked(FREE + "}")
    quantity = seen(name)
    inside = 0.1 * np.ptp(along(free_walk, free, quantity)[SETTLED:])
    sign = 1.0 if side == "upper" else -1.0
    if name == "zmp_y" and side == "lower":  # its least value is where the box begins after a touchdown
        inside = 0.0
    limit = sign * ((sign * along(free_walk, free, quantity)[SETTLED:]).max() - inside)
    bound = f"{{kind: constant, value: {limit}}}"
    walk, rows = walked(f"{FREE}, b: {{quantity: {name}, side: {side}, bound: {bound}}}}}")
    values = along(walk, rows, quantity)
    assert (sign * (limit - values))[SETTLED:].min() > -1e-6
    assert max(row.plan.slack for row in rows[SETTLED:]) < 1e-6
    if inside:
        assert np.abs(values - along(free_walk, free, quantity))[SETTLED:].max() > 1e-4


def test_barriers_of_all_kinds_together_walk_and_are_logged() -> None:
    scenario = load_scenario("vhip", f"{{duration: 4.0, {FREE}{ALL}}}}}")
    log = simulate(scenario)
    walk, rows = walked(f"{FREE}{ALL}}}")
    assert [barrier.name for barrier in walk.barriers] == [f"on_{name}" for name in QUANTITIES]
    h = log["h"][:TICKS]
    for column, (barrier, quantity) in enumerate(zip(walk.barriers, walk.quantities, strict=True)):
        bounds = np.array([walk.mpc.bounds(row.tick)[barrier.name][0] for row in rows])
        expected = barrier.sign * (bounds - along(walk, rows, quantity))
        np.testing.assert_allclose(h[:, column], expected[: len(h)], atol=1e-9, err_msg=barrier.name)
        assert expected[SETTLED:].min() >= -1e-6, barrier.name


def test_mirrored_feet_and_start_give_the_mirrored_run() -> None:
    """`first_stance` swaps left and right; a mirrored quantity and its bound see no difference."""
    right, rows = walked(f"{FREE}{ALL}}}")
    left, others = walked(f"{{gait: {{first_stance: left}}, {FREE}{ALL}}}}}")
    mirror = np.array([[1.0], [-1.0]])
    for row, other in zip(rows, others, strict=True):
        np.testing.assert_allclose(other.state, row.state * mirror, atol=1e-9)
    for quantity in right.quantities:
        np.testing.assert_allclose(along(left, others, quantity), along(right, rows, quantity), atol=1e-9)


@pytest.mark.parametrize("name", ["com_y", "dcm_y", "zmp_y", "com_x"])
def test_bounds_of_a_start_and_an_end_hold_at_rest_and_only_there(name: str) -> None:
    gait = Gait(GaitConfig(start_steps=3, walk_steps=9))
    quantity = seen(name)
    normals = quantity.normals_of(VHIP, gait.config)
    table = Bound(tuple(0.03 + 0.02 * np.sin(np.arange(N))))
    for sign in (1, -1):
        barrier = WalkBarrier(name, quantity, normals, table, sign, [0.5] * quantity.relative_degree, at_rest=True)
        samples = BoundSamples(barrier, gait, 1)
        for tick in range(20 * N):
            step, bound = tick // N, samples(tick)[0]
            if gait.support(step) == BOTH:
                assert sign * bound >= -1e-12  # q is 0 in the middle between both feet
            if 7 <= step < 10:
                assert bound == table(tick)
            if 3 <= step < 12:
                assert sign * bound >= sign * table(tick)


def test_samples_over_a_horizon_are_those_tick_by_tick() -> None:
    gait = Gait(GaitConfig(start_steps=2, walk_steps=12))
    quantity = seen("com_y")
    barrier = WalkBarrier(
        "b", quantity, quantity.normals_of(VHIP, gait.config), Bound(tuple(np.arange(80.0))), 1, [0.5] * 3, at_rest=True
    )
    one, many = BoundSamples(barrier, gait, 1), BoundSamples(barrier, gait, 81)
    for tick in range(0, 18 * N, 7):
        np.testing.assert_array_equal(many(tick), [one(tick + i)[0] for i in range(81)])


def test_an_axis_is_the_speed_along_it_as_seen_from_the_world() -> None:
    for axis, name in zip("xy", ("forward_speed", "lateral_speed"), strict=True):
        config = parse_config(WalkBarrierConfig, {"axis": axis, "bound": {"kind": "orbit"}}, "b")
        assert config.bounded == QUANTITIES[name]
    walk = build_walk(load_scenario("vhip", f"{FREE}, b: {{axis: y, bound: {{kind: orbit, margin: 0.15}}}}}}"))
    assert walk.barriers[0].bound.period == 2 * N
    np.testing.assert_array_equal(walk.barriers[0].normal, [0.0, 1.0, 0.0])


def test_a_written_config_reads_as_the_same() -> None:
    scenario = load_scenario("vhip", f"{FREE}{ALL}}}")
    for config in scenario.barriers.values():
        assert parse_config(WalkBarrierConfig, config.model_dump(mode="json"), "b") == config


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"quantity": "knee"}, "b.quantity: must be 'forward_speed', 'lateral_speed', 'com_x', 'com_y', 'dcm_x', "),
        ({"quantity": "com_x", "axis": "x"}, "b: quantity com_x and axis x are given, but one barrier bounds one"),
        ({"quantity": "dcm_x", "mirrored": True},
         "b: mirrored is for what is counted across the heading, lateral_speed, com_y, dcm_y, zmp_y (given: dcm_x)"),
    ],
)  # fmt: skip
def test_wrong_quantities_are_refused_with_a_sentence(keys: dict, text: str) -> None:
    with pytest.raises(InputError, match=re.escape(text)):
        parse_config(WalkBarrierConfig, {"bound": {"kind": "orbit"}, **keys}, "b")


@pytest.mark.parametrize("count", [41, 30, 120])
def test_a_table_that_repeats_neither_after_one_step_nor_two_is_refused(count: int) -> None:
    bound = f"{{kind: tabulated, values: {[0.1] * count}}}"
    text = f'barrier "b": the tabulated bound has {count} values, but a bound repeats after a step of 40 ticks or after'
    with pytest.raises(InputError, match=re.escape(text)):
        build_walk(load_scenario("vhip", f"{FREE}, b: {{quantity: com_y, bound: {bound}}}}}"))


@pytest.mark.parametrize("count", [1, 40, 80])
def test_a_table_may_have_a_step_or_two(count: int) -> None:
    bound = f"{{kind: tabulated, values: {[0.2] * count}}}"
    (barrier,) = build_walk(load_scenario("vhip", f"{FREE}, b: {{quantity: com_y, bound: {bound}}}}}")).barriers
    assert barrier.bound.period == count


def test_a_wrong_relative_degree_names_the_computed_one() -> None:
    with pytest.raises(InputError, match="relative degree"):
        build_walk(load_scenario("vhip", f"{FREE}, b: {{quantity: com_x, gamma: [0.5], bound: {{kind: orbit}}}}}}"))


def test_other_class_k_functions_leave_h_as_it_is() -> None:
    barrier = barrier_on("com_y", constant(0.1))
    other = barrier.with_class_k([1.0] * 3)
    assert isinstance(other, AffineBarrier)
    assert [alpha(1.0) for alpha in other.class_k] == [1.0] * 3
    assert other.h(3, np.ones(3)) == barrier.h(3, np.ones(3))


def test_an_input_limit_is_kept_by_every_input_that_is_left() -> None:
    """With given steps the ZMP from the stance foot is d − (1 − w) s."""
    template = stepping_template(GaitConfig(), MpcConfig(step_tolerance=(0.0, 0.0)), 0, 0.23)
    limit = barrier_on("zmp_x", constant(0.03))
    assert is_input_limit(limit)
    assert not is_input_limit(barrier_on("dcm_x", constant(0.1)))
    limited = template.with_input_limit(limit)
    assert limited is not None
    for k in range(template.period):
        from_last = (1.0 - template.weights[k]) * template.held[k]
        highest = limited.inputs[k].vertices[:, 0].max() - from_last
        assert highest == pytest.approx(min(0.03, template.half - from_last))


def test_a_limit_that_no_zmp_keeps_gives_no_template() -> None:
    template = stepping_template(GaitConfig(), MpcConfig(), 0, 0.23)
    assert template.with_input_limit(barrier_on("zmp_x", constant(-0.06))) is None


@pytest.mark.parametrize("name", ["com_y", "lateral_speed", "forward_speed"])
def test_psi_of_a_log_leaves_out_what_compares_two_stance_feet(name: str) -> None:
    bound = "{kind: orbit, margin: 0.05}"
    scenario = load_scenario("vhip", f"{{duration: 3.0, {FREE}, b: {{quantity: {name}, bound: {bound}}}}}}}")
    log = simulate(scenario)
    (use,) = barriers_of(scenario).values()
    psi, order, h = psi_along_log(log, use), len(use.class_k), log["h"][:, 0]
    for row in range(len(psi)):
        crossing = row // N != (row + order) // N
        if crossing and name != "forward_speed":
            assert np.isnan(psi[row])
        else:
            assert psi[row] == pytest.approx(psi_from_h(h[row : row + order + 1], use.class_k)[-1], abs=1e-12)
    found = compute_metrics(scenario, log, 1.0, None).barriers["b"].psi_min
    assert found == pytest.approx(np.nanmin(psi[200:]), abs=1e-12)


def test_what_is_odd_about_a_bound_is_noted() -> None:
    """The nominal walk is beyond it, a table repeats early, or a harmonic is constant."""
    bounds = {
        "behind": "{quantity: com_x, bound: {kind: constant, value: -0.5}}",
        "wide": "{quantity: com_x, side: lower, bound: {kind: constant, value: -0.5}}",
        "short": "{quantity: forward_speed, bound: {kind: tabulated, values: [0.9, 0.8]}}",
        "whole": f"{{quantity: forward_speed, bound: {{kind: tabulated, values: {[0.9] * 40}}}}}",
        "orbit": "{quantity: forward_speed, bound: {kind: orbit, margin: 0.1}}",
        "flat": "{quantity: forward_speed, bound: {kind: harmonic, mean: 0.9, sine: 0.0}}",
        "wave": "{quantity: forward_speed, bound: {kind: harmonic, mean: 0.9, sine: 0.01}}",
    }
    text = ", ".join(f"{name}: {bound}" for name, bound in bounds.items())
    behind, short, flat = notes_on_bounds(load_scenario("vhip_nobarrier", f"barriers: {{{text}}}"))
    assert behind.startswith("barriers.behind: the nominal walk is beyond this bound at 80 of 80 ticks, by 0.5")
    assert short == "barriers.short.bound.values: the table repeats every 2 ticks; a step has 40 ticks"
    assert flat == "barriers.flat.bound: a harmonic with neither cosine nor sine is constant, 0.9 m/s"
