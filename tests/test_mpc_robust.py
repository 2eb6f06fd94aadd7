"""`mpc.robust`: the true state keeps the bound under every disturbance and error of the box; nothing else changes."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from pdhocbf_drake import load_scenario
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.loop import walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.robust import nearer_bound, zmp_margin
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.studies.certify.scenario_certificate import certify_scenario
from pdhocbf_drake.studies.certify.trial import try_sets

COARSE = "gait: {tick: 0.04, ticks_per_step: 10, double_support_ticks: 1}\n"
MOVED, MISSED = (0.0002, 0.001), (0.0002, 0.0005)  # [m, m/s]
FIRST, TICKS = 60, 120  # after the start, in which the bound is wider


def scenario_of(mpc: str, margin: float = 0.005):
    text = COARSE + f"mpc: {{horizon: 20, freeze_ticks: 2, {mpc}}}\n"
    bound = f"barriers: {{forward_speed: {{bound: {{kind: orbit, margin: {margin}}}}}}}\n"
    return load_scenario("vhip", text + bound)


def walk_of(mpc: str):
    return build_walk(scenario_of(mpc))


ROBUST = f"robust: {{disturbance: {list(MOVED)}, estimate: {[side / 3 for side in MISSED]}}}"


def least_h(walk, moved, missed):
    """Least h of the true states, where w(k) and e(k) are given by functions of k."""
    mpc, barrier = walk.mpc, walk.mpc.barriers[0][0]
    memory = Memory.at_start(mpc, walk.at_rest, walk.gait.feet_at_start)

    def sensor(measurement):
        state = measurement.state.copy()
        state[:, :2] += missed(measurement.tick)
        return measurement._replace(state=state)

    rows = walk_template(mpc, memory, 0, FIRST + TICKS, None, sensor, lambda k, state, memory, plan: moved(k))
    return min(barrier.h(row.tick, row.state[0]) for row in rows if row.tick >= FIRST)


CORNERS = [np.array(corner) for corner in product((-1.0, 1.0), repeat=2)]


def test_the_true_speed_stays_below_its_bound_at_every_corner_and_without_it_does_not():
    robust, plain = walk_of(ROBUST), walk_of("barrier: soft")
    worst = {"robust": np.inf, "plain": np.inf}
    for push, error in product(CORNERS, CORNERS):
        for name, walk in (("robust", robust), ("plain", plain)):
            h = least_h(walk, lambda k, push=push: push * MOVED, lambda k, error=error: error * MISSED)
            worst[name] = min(worst[name], h)
    random = np.random.default_rng(2)
    signs = random.choice([-1.0, 1.0], size=(2, FIRST + TICKS + 1, 2, 2))
    h = least_h(robust, lambda k: signs[0, k] * MOVED, lambda k: signs[1, k] * MISSED)
    assert worst["plain"] < 0.0 <= min(worst["robust"], h)


def test_nothing_uncertain_changes_no_bit():
    def plans(walk):
        memory = Memory.at_start(walk.mpc, walk.at_rest, walk.gait.feet_at_start)
        return [row.plan.inputs for row in walk_template(walk.mpc, memory, 0, 60)]

    assert np.array_equal(plans(walk_of("robust: {disturbance: [0, 0]}")), plans(walk_of("barrier: soft")))


def test_programs_are_the_same_and_only_their_parameters_differ():
    robust, plain = walk_of(ROBUST), walk_of("barrier: soft")
    for one, other in zip(robust.mpc.problems, plain.mpc.problems, strict=True):
        assert one.key == other.key


def test_the_zmp_box_shrinks_by_the_error_of_the_com():
    walk = walk_of(ROBUST)
    assert zmp_margin(walk.vhip, walk.mpc.config) == pytest.approx(MISSED[0])
    half = walk.mpc.commanded.steps(4).half
    assert half == pytest.approx(walk_of("barrier: soft").mpc.commanded.steps(4).half - MISSED[0])


def test_a_covariance_is_a_box_of_some_standard_deviations():
    given = "robust: {estimate: [[4.0e-8, 1.0e-8], [1.0e-8, 9.0e-8]], sigmas: 2}"
    assert walk_of(given).mpc.config.robust.errors == pytest.approx((4e-4, 6e-4))


def test_a_bound_is_nearer_for_more_disturbance_error_and_delay():
    sizes = []
    less = "robust: {disturbance: [0, 0.001]}"
    more = "robust: {disturbance: [0.001, 0.001]}", "robust: {estimate: [0, 0.001]}", f"delay: 2, {less}"
    for given in (less, *more):
        walk = walk_of(given)
        sizes.append(nearer_bound(walk.mpc.barriers[0][0], walk.vhip, walk.mpc.config, 0))
    assert np.all(sizes[0] > 0.0)
    assert all(np.all(larger > sizes[0]) for larger in sizes[1:])


def of_boxes(x: list, y: list) -> str:
    return f"robust: {{disturbance: {{x: {x}, y: {y}}}}}"


def nearer(walk, axis: int = 0):
    return nearer_bound(walk.mpc.barriers[0][0], walk.vhip, walk.mpc.config, axis)


def test_boxes_of_each_axis_and_tick_are_paid_for_where_they_count():
    calm, landing, everywhere = [0.0, 0.0001], [0.0002, 0.001], [0.0002, 0.001]
    one, alike = walk_of(of_boxes([landing, *[calm] * 9], [calm])), walk_of(of_boxes([everywhere], [calm]))
    box = walk_of(f"robust: {{disturbance: {everywhere}}}")
    assert np.array_equal(nearer(box), nearer(alike))
    assert np.all(nearer(one) < nearer(box))
    assert nearer(one).argmax() in (1, 2)  # what the first tick of a step adds is there in the next one
    assert np.all(nearer(alike, 1) < nearer(alike, 0))
    assert np.array_equal(nearer(walk_of(of_boxes([everywhere] * 10, [calm] * 10))), nearer(alike))


def test_innovations_that_hold_the_estimate_s_error_are_not_paid_for_twice():
    both = "disturbance: [0.0002, 0.003], estimate: [0.0, 0.001], sigmas: 1"
    once, twice = walk_of(f"robust: {{{both}, innovations: true}}"), walk_of(f"robust: {{{both}}}")
    without = walk_of("robust: {disturbance: [0.0002, 0.003]}")
    assert nearer(once) == pytest.approx(nearer(without) + 0.001)
    assert np.all(nearer(once) < nearer(twice))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            "disturbance: {x: [[0, 0.001], [0, 0.001]], y: [[0, 0]]}",
            "disturbance.x: one box, or one for each of 10 ticks",
        ),
        ("disturbance: {x: [[0, 0.001]]}", "disturbance.y: is needed, but missing"),
        ("disturbance: {x: [], y: [[0, 0]]}", "disturbance.x: must have at least 1 entry"),
        ("disturbance: {z: [[0, 0]]}", "disturbance.z: unknown key; allowed here: x, y"),
        ("disturbance: 0.1", "disturbance: must be a list or a map of keys and values"),
        ("estimate: [[1.0, 2.0], [2.0, 1.0]]", "a covariance is symmetric"),
        ("estimate: [0.1, 0.0]", "the ZMP may err by 0.3 m, which leaves nothing of its box"),
        ("disturbance: [-1, 0]", "must be from 0"),
        ("estimate: [0.0]", "estimate"),
    ],
)
def test_what_can_not_be_is_refused(given, message):
    with pytest.raises(InputError, match=message):
        walk_of(f"robust: {{{given}}}")


def test_a_hard_robust_barrier_has_a_plan_at_every_tick_from_the_set_of_its_rows():
    scenario = scenario_of("barrier: hard, robust: {disturbance: [0.0002, 0.001]}", 0.03)
    found = certify_scenario(scenario, disturbance=(0.0002, 0.001), search=False)
    nearer = nearer_bound(found.axes[0].bounds[0].barrier, found.walk.vhip, scenario.mpc, 0)
    bound = found.axes[0].bounds[0]
    assert bound.barrier.bound.samples(0, 10) - bound.enforced.bound.samples(0, 10) == pytest.approx(nearer)
    trial = try_sets(found, 3, ticks=100)
    assert trial.infeasible_ticks == 0
    assert trial.h_min >= 0.0
