"""Ways from a measured state to the decisions of both axes, to be timed against each other."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
from pydrake.solvers import ClarabelSolver, MathematicalProgram, SolverOptions
from scipy.sparse import csc_matrix

from pdhocbf_drake.qp import DaqpQp, ParametricQp
from pdhocbf_drake.simulation.build import Walk
from pdhocbf_drake.studies.bench.recording import AXES, Tick, solve, theta
from pdhocbf_drake.studies.bench.sparse_program import sparse_qp
from pdhocbf_drake.studies.bench.timing import now

SparseQps = Sequence[Sequence[ParametricQp]]


class Route(ABC):
    """One way to solve x and y of a tick; what can be prepared before the walk is prepared in the constructor.

    Attributes:
        name: as printed.
        failures: solves that did not end as optimal.
    """

    name = ""

    def __init__(self, walk: Walk) -> None:
        self.mpc = walk.mpc
        self.failures = 0

    def seconds(self, given: Tick) -> float:
        """The time that this tick takes [s]."""
        start = now()
        self.decide(given)
        return now() - start

    @abstractmethod
    def decide(self, given: Tick) -> tuple[np.ndarray, ...]:
        """The decisions of x and of y."""


class Ours(Route):
    """`PeriodicMpc.solve`: state, stance and bounds in, plan out."""

    name = "ours"

    def decide(self, given: Tick) -> tuple[np.ndarray, ...]:
        plan = solve(self.mpc, given)
        self.failures += plan.fallbacks > 0
        return tuple(plan.inputs)


class Core(Route):
    """The least that ours can take: the solver's own clock, plus one product of its map with θ.

    The product is ours, of the few coefficients that matter; the dense one takes several times as long.
    """

    name = "solver core"

    def __init__(self, walk: Walk) -> None:
        super().__init__(walk)
        self._solvers = daqp_solvers(walk)

    def seconds(self, given: Tick) -> float:
        total = 0.0
        for axis in AXES:
            solver = self._solvers[axis][given.tick % len(self._solvers[axis])]
            parameters = theta(self.mpc, given, axis)
            start = now()
            solver.prepare(parameters)
            total += now() - start
            solver.solve(parameters, given.guess(axis))
            total += solver.core_seconds
        return total

    def decide(self, given: Tick) -> tuple[np.ndarray, ...]:
        raise NotImplementedError("this is a clock, not a route")


class QpRoute(Route):
    """A solver of compiled programs, one for each axis and phase; subclasses set it up and call it."""

    def __init__(self, walk: Walk, qps: SparseQps) -> None:
        super().__init__(walk)
        self.qps = qps
        self._ready = [[self._set_up(qp) for qp in axis] for axis in qps]

    def decide(self, given: Tick) -> tuple[np.ndarray, ...]:
        answers = []
        for axis in AXES:
            phase = given.tick % len(self.qps[axis])
            f, low, high = self.qps[axis][phase].vectors(theta(self.mpc, given, axis))
            solved, decisions = self._run(self._ready[axis][phase], f, low, high)
            self.failures += not solved
            answers.append(decisions)
        return tuple(answers)

    @abstractmethod
    def _set_up(self, qp: ParametricQp) -> Any:
        """All of a program that can be prepared before its vectors are given."""

    @abstractmethod
    def _run(self, ready: Any, f: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[bool, np.ndarray]:
        """Whether min ½ wᵀPw + fᵀw with low ≤ Aw ≤ high was solved, and w."""


class Rebuilt(QpRoute):
    """Drake as it comes: a new `MathematicalProgram` at every tick, matrices at hand, Clarabel with its defaults."""

    name = "Drake rebuilt"
    _solver = ClarabelSolver()

    def _set_up(self, qp: ParametricQp) -> Any:
        return _matrices(qp)

    def _run(self, ready: Any, f: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[bool, np.ndarray]:
        P, A = ready
        prog, w, _, _ = _program(P, A, f, low, high)
        result = self._solver.Solve(prog, None, None)
        return result.is_success(), result.GetSolution(w)


class Updated(QpRoute):
    """Drake at its best: one program a phase, vectors updated, Clarabel without refinement, scaling and presolve."""

    name = "Drake updated"

    def __init__(self, walk: Walk, qps: SparseQps) -> None:
        super().__init__(walk, qps)
        self._solver, self._options = ClarabelSolver(), SolverOptions()
        for name in ("iterative_refinement_enable", "equilibrate_enable", "presolve_enable"):
            self._options.SetOption(ClarabelSolver.id(), name, 0)

    def _set_up(self, qp: ParametricQp) -> Any:
        free = np.full(len(qp.A), np.inf)
        P, A = _matrices(qp)
        return _program(P, A, qp.linear.offset, -free, free)

    def _run(self, ready: Any, f: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[bool, np.ndarray]:
        prog, w, cost, rows = ready
        cost.UpdateCoefficients(cost.Q(), f[: len(cost.b())], 0.0, is_convex=True)
        rows.UpdateLowerBound(low)
        rows.UpdateUpperBound(high)
        result = self._solver.Solve(prog, None, self._options)
        return result.is_success(), result.GetSolution(w)


def daqp_solvers(walk: Walk) -> list[list[DaqpQp]]:
    """DAQP on our programs of both axes and all phases."""
    return [
        [DaqpQp(qp, problem.bound_rows, problem.guess_rows(qps, phase)) for phase, qp in enumerate(qps)]
        for qps, problem in zip(walk.mpc.qps, walk.mpc.problems, strict=True)
    ]


def sparse_qps(walk: Walk) -> SparseQps:
    """`sparse_qp` of both axes and all phases."""
    return [[sparse_qp(walk, axis, phase) for phase in range(walk.gait.period)] for axis in AXES]


def _matrices(qp: ParametricQp) -> tuple[np.ndarray, Any]:
    """P without the states, which cost nothing and come last; A, sparse."""
    count = int(np.flatnonzero(qp.P.any(axis=1))[-1]) + 1
    return np.asfortranarray(qp.P[:count, :count]), csc_matrix(qp.A)


def _program(P: np.ndarray, A: Any, f: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple:
    """The program, its decisions, the evaluators of its cost and of its rows."""
    prog = MathematicalProgram()
    w = prog.NewContinuousVariables(len(f))
    cost = prog.AddQuadraticCost(P, f[: len(P)], w[: len(P)], is_convex=True).evaluator()
    return prog, w, cost, prog.AddLinearConstraint(A, low, high, w).evaluator()
