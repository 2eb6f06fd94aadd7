"""Ways from a measured state to the decisions of both axes, to be timed against each other."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from pydrake.solvers import ClarabelSolver, MathematicalProgram, SolverOptions
from scipy.sparse import csc_matrix

from pdhocbf_drake.qp import DaqpQp, ParametricQp
from pdhocbf_drake.simulation.build import Walk
from pdhocbf_drake.studies.bench.recording import AXES, Tick, now, solve, theta
from pdhocbf_drake.studies.bench.sparse_program import sparse_qp

Qps = Sequence[Sequence[ParametricQp]]
Seconds = Callable[[Tick], float]


def ours(walk: Walk) -> Seconds:
    """The time of `PeriodicMpc.solve`: state, stance and bounds in, plan out."""

    def seconds(given: Tick) -> float:
        start = now()
        solve(walk.mpc, given)
        return now() - start

    return seconds


def core(walk: Walk) -> Seconds:
    """The least time that ours can take: the solver's own clock, plus one product of its map with θ.

    The product is ours, of the few coefficients that matter; the dense one takes several times as long.
    """
    solvers = daqp_solvers(walk)

    def seconds(given: Tick) -> float:
        total = 0.0
        for axis in AXES:
            solver = solvers[axis][given.tick % len(solvers[axis])]
            parameters = theta(walk.mpc, given, axis)
            steps, start = solver.steps, now()
            steps.prepare(parameters)
            total += now() - start
            solver.solve(parameters, given.guess(axis))
            total += solver.core_seconds
        return total

    return seconds


class Route(ABC):
    """Another solver of compiled programs, one for each axis and phase, set up before the walk.

    Attributes:
        name: as printed.
        qps: the programs, `qps[axis][phase]`.
    """

    name = ""

    def __init__(self, walk: Walk, qps: Qps) -> None:
        self.mpc, self.qps = walk.mpc, qps
        self._ready = [[self._set_up(qp) for qp in axis] for axis in qps]

    def seconds(self, given: Tick) -> float:
        """The time that this tick takes [s]."""
        start = now()
        self.decide(given)
        return now() - start

    def decide(self, given: Tick) -> list[np.ndarray]:
        """The decisions of x and of y."""
        answers = []
        for axis in AXES:
            phase = given.tick % len(self.qps[axis])
            vectors = self.qps[axis][phase].vectors(theta(self.mpc, given, axis))
            answers.append(self._solve(self._ready[axis][phase], *vectors))
        return answers

    @abstractmethod
    def _set_up(self, qp: ParametricQp) -> Any:
        """All of a program that can be prepared before its vectors are given."""

    @abstractmethod
    def _solve(self, ready: Any, f: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """The w that minimizes ½ wᵀPw + fᵀw with low ≤ Aw ≤ high."""


class Rebuilt(Route):
    """Drake as it comes: a new `MathematicalProgram` at every tick, matrices at hand, Clarabel with its defaults."""

    name = "Drake rebuilt"
    _solver = ClarabelSolver()

    def _set_up(self, qp: ParametricQp) -> Any:
        return _matrices(qp)

    def _solve(self, ready: Any, f: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        P, A = ready
        prog, w, _, _ = _program(P, A, f, low, high)
        return self._solver.Solve(prog, None, None).GetSolution(w)


class Updated(Route):
    """Drake at its best: one program a phase, vectors updated, Clarabel without refinement, scaling and presolve."""

    name = "Drake updated"

    def __init__(self, walk: Walk, qps: Qps) -> None:
        super().__init__(walk, qps)
        self._solver, self._options = ClarabelSolver(), SolverOptions()
        for name in ("iterative_refinement_enable", "equilibrate_enable", "presolve_enable"):
            self._options.SetOption(ClarabelSolver.id(), name, 0)

    def _set_up(self, qp: ParametricQp) -> Any:
        free = np.full(len(qp.A), np.inf)
        P, A = _matrices(qp)
        return _program(P, A, qp.linear.offset, -free, free)

    def _solve(self, ready: Any, f: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        prog, w, cost, rows = ready
        cost.UpdateCoefficients(cost.Q(), f[: len(cost.b())], 0.0, is_convex=True)
        rows.UpdateLowerBound(low)
        rows.UpdateUpperBound(high)
        return self._solver.Solve(prog, None, self._options).GetSolution(w)


def daqp_solvers(walk: Walk) -> list[list[DaqpQp]]:
    """DAQP on our programs of both axes and all phases."""
    return [
        [DaqpQp(qp, problem.bound_rows, problem.guess_rows(qps, phase)) for phase, qp in enumerate(qps)]
        for qps, problem in zip(walk.mpc.qps, walk.mpc.problems, strict=True)
    ]


def sparse_qps(walk: Walk) -> Qps:
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
