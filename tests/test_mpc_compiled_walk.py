"""The walk's own programs, compiled, at every phase of a step."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.solvers import ClarabelSolver, SolverOptions

from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.qp import ClarabelQp, DaqpQp
from pdhocbf_drake.simulation.build import Walk, build_walk
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.bench.accuracy import gap
from pdhocbf_drake.studies.bench.recording import record, solve, theta
from pdhocbf_drake.studies.bench.sparse_program import sparse_qp


@pytest.fixture(scope="module")
def walk() -> Walk:
    return build_walk(load_scenario("vhip"))


@pytest.fixture(scope="module")
def short_walk() -> Walk:
    """A gait of few ticks, for what need not be seen at full length."""
    text = "{gait: {ticks_per_step: 20, tick: 0.02}, mpc: {horizon: 40}}"
    return build_walk(load_scenario("vhip", text))


@pytest.mark.parametrize("axis", [0, 1])
def test_compiled_and_uncompiled_agree_at_every_phase(walk: Walk, axis: int) -> None:
    mpc = walk.mpc
    options = SolverOptions()
    for name in ("tol_gap_abs", "tol_gap_rel", "tol_feas"):
        options.SetOption(ClarabelSolver.id(), name, 1e-10)
    for given in record(walk, walk.gait.period, perturbed=True, seed=5).ticks:
        phase, parameters = given.tick % walk.gait.period, theta(mpc, given, axis)
        written = mpc.problems[axis].write(phase)
        written.prog.AddBoundingBoxConstraint(parameters, parameters, written.parameters)
        result = ClarabelSolver().Solve(written.prog, None, options)
        ours = DaqpQp(mpc.qps[axis][phase]).solve(parameters)
        assert result.is_success()
        assert ours.ok
        assert ours.cost == pytest.approx(result.get_optimal_cost(), rel=1e-6, abs=1e-6)
        found = gap(mpc.qps[axis][phase], parameters, ours.decisions, result.GetSolution(written.decisions))
        assert found.certain
        assert abs(found.relative) < 1e-9
        assert found.violation < 1e-9


def test_last_ticks_active_set_moved_by_a_tick_changes_no_plan_and_saves_iterations(short_walk: Walk) -> None:
    mpc = short_walk.mpc
    period = short_walk.gait.period
    moved = [
        [DaqpQp(qp, (), problem.guess_rows(qps, i)) for i, qp in enumerate(qps)]
        for qps, problem in zip(mpc.qps, mpc.problems, strict=True)
    ]
    iterations = {"moved": 0, "nothing": 0}
    last: list[np.ndarray | None] = [None, None]
    for given in record(short_walk, 2 * period, perturbed=True).ticks:
        for axis in (0, 1):
            solver, parameters = moved[axis][given.tick % period], theta(mpc, given, axis)
            cold = solver.solve(parameters)
            iterations["nothing"] += solver.iterations
            warm = solver.solve(parameters, last[axis])
            iterations["moved"] += solver.iterations
            np.testing.assert_allclose(warm.decisions, cold.decisions, atol=1e-8)
            last[axis] = warm.active
    assert iterations["moved"] < 0.5 * iterations["nothing"]


@pytest.mark.parametrize("axis", [0, 1])
def test_the_sparse_program_of_the_benchmark_has_the_same_optimum(short_walk: Walk, axis: int) -> None:
    mpc = short_walk.mpc
    for given in record(short_walk, 12, perturbed=True).ticks[::4]:
        phase, parameters = given.tick % short_walk.gait.period, theta(mpc, given, axis)
        sparse = ClarabelQp(sparse_qp(short_walk, axis, phase)).solve(parameters)
        ours = DaqpQp(mpc.qps[axis][phase]).solve(parameters)
        assert sparse.ok
        assert sparse.cost == pytest.approx(ours.cost, rel=1e-6, abs=1e-6)
        found = gap(mpc.qps[axis][phase], parameters, sparse.decisions[: len(ours.decisions)], ours.decisions)
        assert abs(found.relative) < 1e-5
        assert found.violation < 1e-7


def test_the_walk_is_the_same_through_clarabel(short_walk: Walk) -> None:
    text = "{gait: {ticks_per_step: 20, tick: 0.02}, mpc: {horizon: 40, solver: clarabel}}"
    through_drake = build_walk(load_scenario("vhip_nobarrier", text))
    ours = build_walk(load_scenario("vhip_nobarrier", text.replace("clarabel", "daqp")))
    recorded = record(ours, 10, perturbed=True)
    assert set(recorded.reasons) <= {Reason.SOLVED, Reason.SOFTENED}
    for given in recorded.ticks:
        np.testing.assert_allclose(
            solve(through_drake.mpc, given).inputs[:, 0], solve(ours.mpc, given).inputs[:, 0], atol=1e-3
        )
