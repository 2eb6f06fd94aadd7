"""The filter against enumeration of all active sets, in units that differ by up to 18 powers of ten."""

from __future__ import annotations

import numpy as np
import pytest
from filter_reference import kept_by_priority, nearest

from pdhocbf_drake.barriers import AffineBarrier, BarrierFilter, PeriodicAffineSystem, constant
from pdhocbf_drake.errors import InputError

PROBLEMS = 2000


class Problem:
    """x⁺ = A x + B u with barriers on x, drawn in units of size 1, and the same problem in other units."""

    def __init__(self, seed: int) -> None:
        self.random = random = np.random.default_rng(seed)
        self.n, self.m, self.count = (int(random.integers(1, most)) for most in (4, 4, 5))
        self.draw(random)
        self.order = random.permutation(self.count).tolist()

    def draw(self, random) -> None:
        self.A = np.eye(self.n) + 0.3 * random.normal(size=(self.n, self.n))
        self.B = random.normal(size=(self.n, self.m))
        self.x, self.wanted = random.normal(size=self.n), 2 * random.normal(size=self.m)
        self.normals = random.normal(size=(self.count, self.n))
        self.bounds = self.normals @ self.x + random.uniform(-1.0, 2.0) * random.uniform(0, 1, self.count)
        self.gammas = random.uniform(0.1, 1.0, self.count)
        self.limits = random.uniform(0.2, 4.0, (2, self.m)) * [[-1.0], [1.0]] if random.uniform() < 0.7 else None

    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """a_i·u ≥ b_i with a_i of length 1, by hand: ψ = V̄ − n·(A x + B u) − (1 − γ)(V̄ − n·x)."""
        a = -self.normals @ self.B
        b = -self.bounds + self.normals @ self.A @ self.x + (1 - self.gammas) * (self.bounds - self.normals @ self.x)
        length = np.linalg.norm(a, axis=1)
        return a / length[:, None], b / length

    def limit_rows(self, wide: float) -> tuple[np.ndarray, np.ndarray]:
        eye = np.eye(self.m)
        low, high = np.full((2, self.m), [[-wide], [wide]]) if self.limits is None else self.limits
        return np.vstack([eye, -eye]), np.concatenate([low, -high])

    def filtered(self, of_input: float, of_state: float, of_h: np.ndarray):
        """The filter's result in other units, its input in the first ones."""
        system = PeriodicAffineSystem(self.A, self.B * of_state / of_input)
        barriers = [
            AffineBarrier(f"b{i}", n * scale / of_state, constant(v * scale), 1, [gamma])
            for i, (n, v, gamma, scale) in enumerate(zip(self.normals, self.bounds, self.gammas, of_h, strict=True))
        ]
        low, high = (None, None) if self.limits is None else self.limits * of_input
        keep = BarrierFilter(system, barriers, low, high, priority=[f"b{i}" for i in self.order])
        result = keep(0, self.x * of_state, self.wanted * of_input)
        return result._replace(input=result.input / of_input, psi=result.psi / of_h, slack=result.slack / of_h)


class SmallNumbers(Problem):
    """Of entries −1, 0, 1 and halves: parallel and opposed rows, fixed inputs, corridors without width, ties."""

    def draw(self, random) -> None:
        n, m, count = self.n, self.m, self.count
        self.A = np.eye(n) + 0.5 * random.integers(-1, 2, (n, n))
        self.normals, self.B = np.zeros((count, n)), np.zeros((n, m))
        while not np.all(np.any(self.normals @ self.B, axis=1)):
            self.normals, self.B = random.integers(-1, 2, (count, n)) * 1.0, random.integers(-1, 2, (n, m)) * 1.0
        self.x, self.wanted = random.integers(-2, 3, n) * 0.5, random.integers(-3, 4, m) * 1.0
        self.bounds = self.normals @ self.x + random.integers(-1, 3, count) * 0.5
        self.gammas = random.choice([0.25, 0.5, 1.0], count)
        self.limits = random.integers(0, 3, (2, m)) * [[-1.0], [1.0]] if random.uniform() < 0.7 else None


def units(random: np.random.Generator, count: int) -> tuple[float, float, np.ndarray]:
    one, other, *rest = 10.0 ** random.uniform(-9, 9, count + 2)
    return float(one), float(other), np.array(rest)


@pytest.mark.parametrize("kind", [Problem, SmallNumbers])
@pytest.mark.parametrize("part", range(2))
def test_the_answer_is_that_of_enumeration_in_any_units(kind, part):
    """Where some input satisfies all barriers, the nearest one; elsewhere the lexicographic one."""
    statuses = []
    for seed in range(part, PROBLEMS, 2):
        problem = kind(seed)
        a, b = problem.rows()
        result = problem.filtered(*units(problem.random, len(b)))
        limits = problem.limit_rows(1e3 * (1.0 + np.abs(b).max()))  # wider than any answer, where there are none
        expected = nearest(problem.wanted, np.vstack([a, limits[0]]), np.concatenate([b, limits[1]]))
        missed: set[int] = set()
        if expected is None:
            expected, missed = kept_by_priority(problem.wanted, a, b, limits, problem.order)
        statuses.append(result.status)
        assert result.status == ("softened" if missed else "solved"), seed
        assert result.input == pytest.approx(expected, abs=1e-6 * np.linalg.norm(expected) + 1e-9), seed
        assert set(np.flatnonzero(result.slack)) == missed, seed
    assert 0.1 < np.mean([status == "softened" for status in statuses]) < 0.6


def test_a_barrier_out_of_reach_costs_none_that_is_within_reach():
    """Input 1 moves x_1 too little to keep "far"; input 2 keeps "near" as if "far" were not there."""
    system = PeriodicAffineSystem(np.eye(2), [[1e-5, 0.0], [0.0, 0.1]])
    far, near = (
        AffineBarrier(name, row, constant(1.0), 1, [0.3]) for name, row in zip(("far", "near"), np.eye(2), strict=True)
    )
    for barriers in ([far, near], [near, far]):
        result = BarrierFilter(system, barriers, [-1, -1], [1, 1])(0, [1.5, 0.99], [1, 1])
        assert result.status == "softened"
        assert result.input == pytest.approx([-1.0, 0.03], rel=1e-12)
        assert np.count_nonzero(result.slack) == 1
        assert result.slack.max() == pytest.approx(0.15 - 1e-5, rel=1e-12)


def test_of_barriers_that_exclude_each_other_the_more_important_one_is_kept():
    system = PeriodicAffineSystem([[1.0]], [[1.0]])
    under, over = (
        AffineBarrier("under", [1.0], constant(0.0), 1, [0.5]),
        AffineBarrier("over", [1.0], constant(1.0), -1, [0.5]),
    )
    for priority, u in (((), -0.25), (["over"], 0.25), (["under", "over"], -0.25), (["over", "under"], 0.25)):
        result = BarrierFilter(system, [under, over], priority=priority)(0, [0.5], [3.0])
        assert result.input == pytest.approx([u], rel=1e-12)
        assert sorted(result.slack) == pytest.approx([0.0, 0.5], rel=1e-12)
        assert result.reason == "no input satisfies every barrier at once"
    # a hopeless barrier of high priority does not cost a lower one that can be kept
    steep = AffineBarrier("steep", [1.0], constant(-9.0), 1, [0.5])
    result = BarrierFilter(system, [steep, over], [-1.0], [1.0])(0, [0.5], [0.0])
    assert result.input == pytest.approx([0.25], rel=1e-12)
    assert (result.slack > 0).tolist() == [True, False]


@pytest.mark.parametrize("priority", ["under", ["above"], ["under", "under"], [1], 3, None])
def test_a_priority_names_barriers(priority):
    barrier = AffineBarrier("under", [1.0], constant(0.0), 1, [0.5])
    with pytest.raises(InputError, match="the priority is a list of different names among under, given"):
        BarrierFilter(PeriodicAffineSystem([[1.0]], [[1.0]]), [barrier], priority=priority)


@pytest.mark.parametrize("size", [1e-9, 1e-3, 1.0, 1e6, 1e9])
@pytest.mark.parametrize("limited", [True, False])
def test_a_double_integrator_in_any_unit_of_input(size, limited):
    system = PeriodicAffineSystem([[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1 / size]])
    limits = ([-5 * size], [5 * size]) if limited else (None, None)
    keep = BarrierFilter(system, [AffineBarrier("a", [1, 0], constant(1.0), 1, [0.3, 0.3])], *limits)
    for wanted in (1.0, 1e3, 1e9, 1e15):
        result = keep(0, [0.9, 0.3], [wanted * size])
        assert result.status == "solved"
        assert result.input / size == pytest.approx([-0.9], rel=1e-9)
        assert abs(result.psi[0]) < 1e-12
    speeds = [AffineBarrier(f"v{v}", [0, 1], constant(v), 1, [0.3]) for v in (0.4, 0.35, 0.5)]
    assert BarrierFilter(system, speeds, *limits)(0, [0.9, 0.3], [size]).input / size == pytest.approx([0.15])


def test_rows_at_a_small_angle_are_met_by_the_distant_input_at_which_they_cross():
    """The second input shows a millionth of the first: u_1 ≤ −1 and u_1 + 1e-6 u_2 ≥ 0 need u_2 = 1e6."""
    system = PeriodicAffineSystem(np.eye(2), [[1.0, 0.0], [1.0, 1e-6]])
    barriers = [
        AffineBarrier("a", [1, 0], constant(-1.0), 1, [1.0]),
        AffineBarrier("b", [0, 1], constant(0.0), -1, [1.0]),
    ]
    result = BarrierFilter(system, barriers)(0, [0.0, 0.0], [0.0, 0.0])
    assert result.status == "solved"
    assert result.input == pytest.approx([-1.0, 1e6], rel=1e-9)
    assert BarrierFilter(system, barriers, [-9, -9e5], [9, 9e5])(0, [0.0, 0.0], [0.0, 0.0]).status == "softened"


class Clipped:
    """x⁺ = x + 0.1 clip(u, ±limit)."""

    period, n, m = 1, 1, 1

    def __init__(self, limit: float) -> None:
        self.limit = limit

    def step(self, k, x, u):
        return np.array([x[0] + 0.1 * np.minimum(np.maximum(u[0], -self.limit), self.limit)])


def test_dynamics_that_clip_their_input_are_found():
    barrier = AffineBarrier("a", [1.0], constant(1.0), 1, [0.3])
    for limit in (5.0, 1e5):
        with pytest.raises(InputError, match="psi_1 is not affine in the input"):
            BarrierFilter(Clipped(limit), [barrier])
    keep = BarrierFilter(Clipped(5.0), [barrier], [-5.0], [5.0])  # within the limits they clip nothing
    for wanted in (10.0, 5.0, 0.0):
        result = keep(0, [2.0], [wanted])
        assert result.status == "solved"
        assert result.input == pytest.approx([-3.0], rel=1e-9)


@pytest.mark.parametrize("wanted", [-10.0, -4.0, 0.0, 4.0, 10.0])
def test_dynamics_that_clip_their_input_at_run_time_alone_get_a_safe_input(wanted):
    """An actuator that saturates more strongly than when the filter was built."""
    system = Clipped(1e9)
    keep = BarrierFilter(system, [AffineBarrier("a", [1.0], constant(1.0), 1, [0.3])])
    system.limit = 5.0
    for x in (1.2, 2.0, 2.6):
        result = keep(0, [x], [wanted])
        assert result.status == "solved"
        assert result.psi[0] >= -1e-12
        assert result.psi[0] == pytest.approx(1 - system.step(0, [x], result.input)[0] + 0.7 * (x - 1.0), abs=1e-12)
    lost = keep(0, [3.0], [wanted])
    assert lost.status == "softened"
    assert lost.psi[0] == pytest.approx(-0.1)
    assert lost.reason == "psi is not affine in the input here, and no input was found that satisfies every barrier"
