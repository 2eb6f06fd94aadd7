"""Invariant sets under a bounded disturbance: against a reference, and against an adversary just beyond the largest."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection

from pdhocbf_drake import certify, load_scenario
from pdhocbf_drake.barriers import PeriodicAffineSystem
from pdhocbf_drake.cli import main
from pdhocbf_drake.mpc.config import AxisBoxes, RobustConfig
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.terminal_set import limits_of, load_terminal_sets, save_terminal_sets
from pdhocbf_drake.sets.disturbance import TOLERANCE, Largest, largest_disturbance
from pdhocbf_drake.sets.invariant_set import broken_phases, invariant_set
from pdhocbf_drake.sets.polytope import Polytope
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.studies.certify.adversary import adversary
from pdhocbf_drake.studies.certify.certificate import LargestDisturbance, certify_scenario
from pdhocbf_drake.studies.certify.disturbance_report import disturbance_data
from pdhocbf_drake.studies.certify.psi_rows import psi_disturbance
from pdhocbf_drake.studies.certify.starts import inside_starts, zmp_range
from pdhocbf_drake.studies.certify.terminal import terminal_sets
from pdhocbf_drake.studies.certify.trial import try_sets, walk_from
from pdhocbf_drake.studies.shared.stepping_template import com_reach, stepping_template

SYSTEMS = range(10)


def random_problem(seed: int):
    """An unstable system of period 3 with two states, one input that is stronger to one side, and a skew W_k."""
    random = np.random.default_rng(seed)
    A = np.array([np.eye(2) + 0.3 * random.normal(size=(2, 2)) for _ in range(3)])
    B, c = random.normal(size=(3, 2, 1)), 0.02 * random.normal(size=(3, 2))
    states = [Polytope.box([-1.0, -1.0 - 0.2 * k], [1.5, 1.0]) for k in range(3)]
    corners = 0.05 * (1 + seed) * random.normal(size=(3, 3, 2))
    corners -= corners.mean(axis=1, keepdims=True)  # triangles around 0
    return PeriodicAffineSystem(A, B, c), states, [Polytope.box([-0.3], [0.6])], list(corners)


def corners_of(rows, bounds):
    """The vertices of {z : rows z ≤ bounds} about its deepest point, or None where it holds no ball of 1e-9."""
    size = np.linalg.norm(rows, axis=1)
    rows, bounds = rows[size > 0] / size[size > 0, None], bounds[size > 0] / size[size > 0]
    n = rows.shape[1]
    deepest = linprog(
        -np.eye(n + 1)[n], np.column_stack([rows, np.ones(len(rows))]), bounds, bounds=[(None, None)] * n + [(0, 1)]
    )
    if deepest.status != 0 or deepest.x[-1] < 1e-9:
        return None
    return HalfspaceIntersection(np.column_stack([rows, -bounds]), deepest.x[:-1]).intersections


def reference(system, states, inputs, corners, sweeps=400):
    """Areas of C_k, or None: {(x, u)} with A x + B u + c + w in the next set for each corner w, projected onto x."""
    limits = [(part.A, part.b) for part in states]
    rows, areas = [limits[k % len(limits)] for k in range(system.period)], np.full(system.period, np.inf)
    for _ in range(sweeps):
        before = areas.copy()
        for k in reversed(range(system.period)):
            (now, now_b), (after, after_b) = limits[k % len(limits)], rows[(k + 1) % system.period]
            allowed = inputs[k % len(inputs)]
            blocks = [np.hstack([now, np.zeros((len(now), system.m))])]
            blocks += [np.hstack([np.zeros((len(allowed.A), system.n)), allowed.A])]
            bounds = [now_b, allowed.b]
            for w in corners[k]:
                blocks.append(np.hstack([after @ system.A(k), after @ system.B(k)]))
                bounds.append(after_b - after @ (system.c(k) + w))
            points = corners_of(np.vstack(blocks), np.concatenate(bounds))
            if points is None:
                return None
            hull = ConvexHull(points[:, : system.n])
            rows[k], areas[k] = (hull.equations[:, :-1], -hull.equations[:, -1]), hull.volume
        if np.all(np.abs(areas - before) < 1e-11):
            return areas
    raise AssertionError("the reference does not settle")


def largest_of(problem):
    system, states, inputs, corners = problem

    def solve(scale, within):
        scaled = [scale * part for part in corners]
        return invariant_set(system, states, inputs, disturbance=scaled, within=within)

    return largest_disturbance(solve, [(0.0, invariant_set(system, states, inputs))])


@pytest.mark.parametrize("seed", SYSTEMS)
def test_verdict_and_areas_are_those_of_the_reference(seed):
    system, states, inputs, corners = random_problem(seed)
    found = invariant_set(system, states, inputs, disturbance=corners)
    expected = reference(system, states, inputs, corners)
    assert found.enforceable == (expected is not None)
    if expected is not None:
        assert [part.volume() for part in found.sets] == pytest.approx(expected, abs=1e-6)
        assert broken_phases(system, found.sets, inputs * 3, corners) == ()


def test_the_reference_is_tried_on_both_verdicts():
    verdicts = [reference(*random_problem(seed)) is None for seed in SYSTEMS]
    assert True in verdicts and False in verdicts


def losing_sets(problem, scale):
    """S_0 = X, S_j: the states that can be kept for j ticks under `scale` times W, until one is empty; by phase."""
    system, states, inputs, corners = problem
    parts, k, sets = states, 0, [states[0]]  # the game ends at phase 0
    while sets[-1] is not None:
        k = (k - 1) % system.period
        inner = sets[-1].less(scale * corners[k])
        sets.append(None)
        if inner is not None:
            now, after = parts[k % len(parts)], inner
            rows = np.vstack([
                np.hstack([now.A, np.zeros((len(now.A), system.m))]),
                np.hstack([np.zeros((len(inputs[0].A), system.n)), inputs[0].A]),
                np.hstack([after.A @ system.A(k), after.A @ system.B(k)]),
            ])  # fmt: skip
            points = corners_of(rows, np.concatenate([now.b, inputs[0].b, after.b - after.A @ system.c(k)]))
            sets[-1] = None if points is None else Polytope.from_vertices(points[:, : system.n])
    return sets


def best_input(problem, largest, k, x):
    """The input after which the worst disturbance leads deepest into the largest one's sets, or least far out."""
    system, _, inputs, corners = problem
    target = largest.sets.sets[(k + 1) % system.period]
    worst = (largest.scale * corners[k] @ target.A.T).max(axis=0)
    base, on = target.b - worst - target.A @ (system.A(k) @ x + system.c(k)), target.A @ system.B(k)
    rows = np.vstack([np.column_stack([on, -np.ones(len(on))]), np.column_stack([inputs[0].A, np.zeros(2)])])
    return linprog([0.0, 1.0], rows, np.concatenate([base, inputs[0].b]), bounds=[(None, None)] * 2).x[:1]


@pytest.mark.parametrize("seed", SYSTEMS)
def test_at_the_largest_disturbance_all_corners_are_withstood_and_just_beyond_an_adversary_wins(seed):
    problem = random_problem(seed)
    system, states, _, corners = problem
    largest = largest_of(problem)
    assert largest.scale > 0.0
    for k, part in enumerate(largest.sets.sets):  # every corner from every vertex leads back into the sets
        target = largest.sets.sets[(k + 1) % system.period]
        for x in part.vertices:
            after = system.step(k, x, best_input(problem, largest, k, x))
            assert target.violation(after + largest.scale * corners[k]).max() < 1e-6
    scale = 1.05 * largest.scale
    lost = losing_sets(problem, scale)
    ticks = len(lost) - 1
    for start in largest.sets.sets[-ticks % system.period].vertices:
        x = start
        for left in range(ticks, 0, -1):
            k = -left % system.period
            after = system.step(k, x, best_input(problem, largest, k, x))
            reached = after + scale * corners[k]
            beyond = lost[left - 1].violation(reached)
            x = reached[beyond.argmax()]
            if states[(k + 1) % system.period].violation(x) > 0.0:
                break
        else:
            pytest.fail("the adversary did not win")


def test_one_dimension_by_hand():
    # x⁺ = 2x + u + w with |u| ≤ 1: |x| ≤ 1 − |w| can be kept.
    system, box = PeriodicAffineSystem([[2.0]], [[1.0]]), [Polytope.box([-1.0], [1.0])]
    found = invariant_set(system, [Polytope.box([-5.0], [5.0])], box, disturbance=[np.array([[-0.25], [0.25]])])
    assert found.sets[0].vertices.ravel() == pytest.approx([-0.75, 0.75], abs=1e-8)


def test_no_disturbance_changes_no_bit():
    system, states, inputs, _ = random_problem(0)
    plain = invariant_set(system, states, inputs)
    zero = invariant_set(system, states, inputs, disturbance=[np.zeros((4, 2))])
    assert all(np.array_equal(a.vertices, b.vertices) for a, b in zip(plain.sets, zero.sets, strict=True))


PULL = "A: [[2.0]]\nB: [[1.0]]\nstates: {lower: [-5.0], upper: [5.0]}\ninputs: {lower: [-1.0], upper: [1.0]}\n"


def certified(folder, *options):
    assert main(["certify", "pull.yaml", "--out", "c", *options]) == 0
    return json.loads((folder / "c/certify.json").read_text())


def test_a_system_gets_the_largest_multiple_of_its_disturbance(elsewhere, capsys):
    # |x| ≤ 1 − |w| can be kept, where it holds w: the largest multiple of 0.25 is 2.
    (elsewhere / "pull.yaml").write_text(PULL)
    data = certified(elsewhere, "--disturbance", "0.25")
    assert data["disturbance"] == [0.25]
    assert data["disturbance_max"] == pytest.approx(2.0, rel=TOLERANCE)
    assert [row["disturbance_max"] for row in data["disturbance_table"]] == [data["disturbance_max"]]
    assert "times the given one" in capsys.readouterr().out
    (elsewhere / "pull.yaml").write_text(PULL + "disturbance: {rows: [[1.0], [-1.0]], bounds: [0.5, 2.0]}\n")
    assert not certified(elsewhere)["enforceable"]
    assert certified(elsewhere)["disturbance_max"] == pytest.approx(0.4, rel=TOLERANCE)
    (elsewhere / "pull.yaml").write_text(PULL)
    assert certified(elsewhere)["disturbance_max"] is None
    assert certified(elsewhere, "--disturbance", "0")["disturbance_max"] is None


@pytest.mark.parametrize(
    ("extra", "options", "message"),
    [
        ("", ["--disturbance", "1", "2"], "a disturbance is 1 half-widths from 0"),
        ("", ["--disturbance", "-1"], "a disturbance is 1 half-widths from 0"),
        ("", ["--disturbance", "nan"], "a disturbance is 1 half-widths from 0"),
        ("disturbance: {lower: [0.1], upper: [0.2]}\n", [], "a disturbance may be 0"),
    ],
)
def test_a_disturbance_that_can_not_be_one_is_refused(elsewhere, capsys, extra, options, message):
    (elsewhere / "pull.yaml").write_text(PULL + extra)
    assert main(["certify", "pull.yaml", *options]) == 1
    assert message in capsys.readouterr().err


def test_a_fixed_state_that_a_disturbance_moves_is_named(elsewhere, capsys):
    text = "A: [[0.5, 0.0], [0.0, 1.0]]\nB: [[1.0], [0.0]]\nstates: {lower: [-1.0, 1.0], upper: [1.0, 1.0]}\n"
    (elsewhere / "pull.yaml").write_text(text + "inputs: {lower: [-1.0], upper: [1.0]}\n")
    assert certified(elsewhere, "--disturbance", "0.1", "0")["enforceable"]
    assert not certified(elsewhere, "--disturbance", "0.1", "0.1")["enforceable"]
    assert "the disturbance moves state 1, which is fixed at phase 0" in capsys.readouterr().out


COARSE = "gait: {tick: 0.04, ticks_per_step: 10, double_support_ticks: 1}\nmpc: {horizon: 20, freeze_ticks: 2}\n"

BOX = [0.0002, 0.002]


def test_a_walk_gets_a_table_in_which_more_demands_withstand_less():
    data = certify(load_scenario("vhip", COARSE), disturbance={"x": [BOX], "y": [BOX] * 10}, rows=False)
    table = {(row["axis"], *row["barriers"]): row["disturbance_max"] for row in data["disturbance_table"]}
    assert table["x",] > table["x", "forward_speed"] > 0.0
    assert data["disturbance"] == {"x": [BOX], "y": [BOX] * 10}
    assert data["disturbance_max"] == min(table["x", "forward_speed"], table["y",])


def test_the_disturbance_of_the_psi_system_is_that_of_the_template_in_other_coordinates():
    scenario = load_scenario("vhip", COARSE)
    barrier = build_walk(scenario).mpc.barriers[0][0]
    template = stepping_template(scenario.gait, scenario.mpc, 0, com_reach(scenario))
    random = np.random.default_rng(3)
    points = np.append(random.normal(size=(4, 2)), np.zeros((4, 1)), axis=1)
    first = 1.0 - barrier.class_k[0].gamma
    for k, added in enumerate(psi_disturbance(template, barrier, [points] * template.period)):
        state, zmps = random.normal(size=3), random.normal(size=(2, 2))

        def after(w, k=k, state=state, zmps=zmps):
            """[c, v, psi_1, s](k + 1) with w on the state of k + 1, by two steps of the template."""
            one = template.system.step(k, state, zmps[0]) + w
            two = template.system.step(k + 1, one, zmps[1])
            h = [barrier.sign * (barrier.bound(k + i) - barrier.normal[1] * x[1]) for i, x in ((1, one), (2, two))]
            return np.array([*one[:2], h[1] - first * h[0], one[2]])

        assert np.array([after(w) for w in points]) - after(np.zeros(3)) == pytest.approx(added, abs=1e-12)


def pattern(landing: float, calm: float = 0.1) -> AxisBoxes:
    """Disturbances of the walk's ten ticks, that of the tick after a touchdown by itself."""
    boxes = tuple((0.002 * share, 0.02 * share) for share in (landing, *[calm] * 9))
    return AxisBoxes(x=boxes, y=boxes)


def test_boxes_of_each_tick_that_are_alike_are_one_box_and_a_large_one_costs_less_than_one_at_every_tick():
    scenario = load_scenario("vhip", COARSE)
    found = [
        certify_scenario(scenario, with_rows=False, search=False, disturbance=RobustConfig(disturbance=given))
        for given in ((0.001, 0.01), pattern(0.5, 0.5), pattern(0.5))
    ]
    for box, alike, landing in zip(*(one.axes for one in found), strict=True):
        for part, same, larger in zip(box.kept.sets, alike.kept.sets, landing.kept.sets, strict=True):
            assert np.array_equal(part.vertices, same.vertices)
            assert larger.violation(part.vertices).max() < 1e-7
            assert larger.volume() > 1.1 * part.volume()


@pytest.mark.parametrize("kind", ["soft", "hard"])
def test_late_measurements_and_their_errors_are_withstood(kind):
    scenario = load_scenario("vhip", COARSE.replace("freeze_ticks: 2", f"freeze_ticks: 2, delay: 2, barrier: {kind}"))
    given = RobustConfig(disturbance=pattern(0.4), estimate=(0.001, 0.002), sigmas=1.0, innovations=True)
    late = certify_scenario(scenario, with_rows=kind == "hard", disturbance=given, search=False)
    for axis, certificate in enumerate(late.axes):
        missed = np.array(list(product((-0.001, 0.001), (-0.002, 0.002))))
        for k, part in enumerate(certificate.kept.sets):  # both what is late and what is missed comes off the limits
            unknown = [certificate.disturbance.moved(certificate.template, k, i)[:, :2] for i in (k, k - 1, k - 2)]
            states = part.vertices[:, :2]
            for points in (*unknown, missed):
                states = np.array([state + w for state in states for w in points])
            for barrier in late.walk.mpc.barriers[axis]:
                seen = np.column_stack([states, np.zeros(len(states))])
                assert min(barrier.h(k, state) for state in seen) >= 0.0
    trial = try_sets(late, 3, ticks=60)
    assert trial.infeasible_ticks == 0
    assert trial.h_min >= 0.0


def test_a_scenario_without_mpc_robust_is_certified_for_numbers_only(elsewhere, capsys):
    assert main(["certify", "vhip", "--text", COARSE, "--disturbance"]) == 1
    assert "--disturbance takes half-widths, or those of mpc.robust" in capsys.readouterr().err


@pytest.fixture(scope="module", params=["soft", "hard"])
def disturbed(request):
    """A walk whose sets withstand a little less than the largest disturbance, with its controller."""
    half_widths = (0.0021, 0.021) if request.param == "soft" else (0.0019, 0.019)
    scenario = load_scenario("vhip", COARSE.replace("freeze_ticks: 2", f"freeze_ticks: 2, barrier: {request.param}"))
    return certify_scenario(scenario, with_rows=request.param == "hard", disturbance=half_widths, search=False)


def test_a_walk_keeps_its_bound_and_has_a_plan_at_every_tick_under_what_its_sets_withstand(disturbed):
    trial = try_sets(disturbed, 6, ticks=150)
    assert trial.infeasible_ticks == 0
    assert trial.h_min >= 0.0


def test_the_largest_multiple_counts_the_barrier_s_own_gamma_and_both_axes(disturbed):
    def row(names, gamma, scale):
        return LargestDisturbance(names, gamma, Largest(scale, None, 1))

    speed = ("forward_speed",)
    x = [row((), None, 8.0), row(speed, None, 5.0), row(speed, (0.5, 0.5), 4.0), row(speed, (0.2, 0.2), 1.0)]
    y = [row((), None, 6.0)]
    axes = [replace(axis, largest=tuple(part)) for axis, part in zip(disturbed.axes, (x, y), strict=True)]
    data = disturbance_data(replace(disturbed, axes=tuple(axes)))
    assert data["disturbance_max"] == (4.0 if disturbed.scenario.mpc.barrier == "hard" else 5.0)
    assert [part["gamma"] for part in data["disturbance_table"]] == [None, None, [0.5, 0.5], [0.2, 0.2], None]


def test_beyond_that_the_worst_disturbance_breaks_a_limit_from_every_start(disturbed):
    random = np.random.default_rng(5)
    walk, beyond = disturbed.walk, [c.disturbance.times(1.12) for c in disturbed.axes]
    mpc = PeriodicMpc(walk.gait, walk.vhip, disturbed.scenario.mpc, walk.mpc.barriers, terminal_sets(disturbed))
    for _ in range(3):
        y = inside_starts(disturbed.axes[1].kept, 1, random)[0]
        x = inside_starts(disturbed.axes[0].kept, 1, random, y.phase % 10)[0]
        zmps = [zmp_range(c.template, c.kept, start, c.disturbance)[0]
                for c, start in zip(disturbed.axes, (x, y), strict=True)]  # fmt: skip
        worst = adversary(
            "worst", beyond, [c.template for c in disturbed.axes], [c.kept for c in disturbed.axes], random
        )
        walked = walk_from(mpc, [x, y], zmps, 300, worst)
        assert walked.infeasible_ticks > 0 or walked.h_min < 0.0


def test_a_set_that_withstands_a_disturbance_survives_its_file(disturbed, tmp_path):
    sets, scenario = terminal_sets(disturbed), disturbed.scenario
    limits = limits_of(scenario.gait, scenario.mpc, scenario.barriers)
    save_terminal_sets(tmp_path / "set.npz", sets, limits)
    for axis, loaded in load_terminal_sets(tmp_path / "set.npz", limits).items():
        assert len(loaded.first) == sets[axis].period
        for mine, read in zip(
            sets[axis].first + sets[axis].first_bounds, loaded.first + loaded.first_bounds, strict=True
        ):
            assert np.array_equal(mine, read)
