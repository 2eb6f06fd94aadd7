"""A safety filter: the input nearest to a wanted one for which every barrier's ψ_m ≥ 0."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.solvers import ClarabelSolver, MathematicalProgram, MathematicalProgramResult, SolverOptions

from pdhocbf_drake.barriers.barrier import Barrier
from pdhocbf_drake.barriers.checks import finite_number, number_array, vector
from pdhocbf_drake.barriers.dynamics import PeriodicSystem, check_system
from pdhocbf_drake.barriers.relative_degree import enforced_row
from pdhocbf_drake.barriers.requirements import check_barriers
from pdhocbf_drake.errors import InputError

_SLACK_WEIGHT = 1e6  # per squared unit of input; for the soft program, solved where the hard one has no solution
_TOLERANCE = 1e-11
_ACCEPTED = 1e-8  # largest violation of ψ_m ≥ tightening by a solution, as a share of 1 + |ψ_m| without it


class FilterResult(NamedTuple):
    """The filtered input and the ψ_m of the barriers there.

    Attributes:
        input: u(k), (n_u,).
        status: "solved"; "softened", where no input satisfies every row and the violations are least in the sum of
            their squares; "failed", where the input is the wanted one, clipped to its limits.
        psi: each barrier's ψ_m at that input, (n_b,) [unit of its h].
        slack: by how much each ψ_m falls short of its tightening, ≥ 0, (n_b,) [unit of its h].
        reason: a sentence for anything but "solved".
    """

    input: NDArray[np.float64]
    status: Literal["solved", "softened", "failed"]
    psi: NDArray[np.float64]
    slack: NDArray[np.float64]
    reason: str = ""


class BarrierFilter:
    """min_u ‖u − u_wanted‖² subject to ψ_m(k) ≥ tightening for each barrier, and lower ≤ u ≤ upper.

    ψ_m must be affine in u(k), as it is for control-affine dynamics and an h that is affine in the states that the
    input reaches; the class-K functions may be nonlinear, since their arguments do not depend on u(k). Each row is
    divided by the norm of its gradient, so that "softened" weighs a violation by the change of input that removes it.

    Args:
        system: the dynamics.
        barriers: any number, with different relative degrees if need be.
        lower, upper: limits of the input, (n_u,); None for none.
        tightening: d̄ ≥ 0 [unit of h], one for all barriers: ψ_m ≥ d̄ withstands |d| ≤ d̄ on h(k+m).
        states: (S, n), states at which h and the dynamics are defined, where they are checked.

    Raises:
        InputError: a declared relative degree is not the computed one; ψ_m is not affine in the input; limits that
            leave no input; or a tightening that is negative or not finite.
    """

    def __init__(
        self,
        system: PeriodicSystem,
        barriers: Sequence[Barrier],
        lower: ArrayLike | None = None,
        upper: ArrayLike | None = None,
        tightening: float = 0.0,
        states: ArrayLike | None = None,
    ) -> None:
        self.system = check_system(system)
        self.barriers = check_barriers(barriers, system, states, "BarrierFilter")
        self.lower = np.full(system.m, -np.inf) if lower is None else number_array("the lower limits", lower)
        self.upper = np.full(system.m, np.inf) if upper is None else number_array("the upper limits", upper)
        self.tightening = finite_number("the tightening", tightening, 0.0)
        fit = self.lower.shape == self.upper.shape == (system.m,) and np.all(self.lower <= self.upper)
        if not (fit and np.all(self.lower < np.inf) and np.all(self.upper > -np.inf)):
            raise InputError(
                f"input limits must be two vectors of {system.m}, lower <= upper, given {lower!r} and {upper!r}"
            )

    def __call__(self, k: int, x: ArrayLike, wanted: ArrayLike) -> FilterResult:
        """The filtered input at tick k and state x (n,), for the wanted input (n_u,).

        Raises:
            InputError: shapes that do not fit the system. Numbers that are not finite give the status "failed".
        """
        state, target = vector("the state x", x, self.system.n), vector("the wanted input", wanted, self.system.m)
        state, target = state.astype(float), target.astype(float)
        clipped = np.clip(np.nan_to_num(target), self.lower, self.upper)
        unknown = np.full(len(self.barriers), np.nan)
        if not (np.all(np.isfinite(state)) and np.all(np.isfinite(target))):
            return FilterResult(clipped, "failed", unknown, unknown, "the state or the wanted input is not finite")
        at_clipped = [enforced_row(barrier, self.system, k, state, clipped)[:2] for barrier in self.barriers]
        psi = np.array([value for value, _ in at_clipped])
        gradient = np.array([slope for _, slope in at_clipped]).reshape(-1, self.system.m)
        if not (np.all(np.isfinite(psi)) and np.all(np.isfinite(gradient))):
            return FilterResult(clipped, "failed", psi, unknown, "a barrier is not finite at this state")
        if np.all(psi >= self.tightening):  # the nearest input within the limits is safe: no program to solve
            return FilterResult(clipped, "solved", psi, np.zeros(len(psi)))
        for status, soft in (("solved", False), ("softened", True)):
            delta, result = self._solve(clipped, target, psi, gradient, soft)
            if delta is not None:
                after = psi + gradient @ delta
                if not soft and np.any(self.tightening - after > _ACCEPTED * (1 + np.abs(psi))):
                    continue  # a row that does not depend on the input here, or numbers too large for the solver
                slack = np.maximum(self.tightening - after, 0.0) if soft else np.zeros(len(psi))
                reason = "no input satisfies every barrier at once" if soft else ""
                return FilterResult(clipped + delta, status, after, slack, reason)  # type: ignore[arg-type]
        reason = f"the solver stopped with {result.get_solution_result().name}"
        return FilterResult(clipped, "failed", psi, np.maximum(self.tightening - psi, 0.0), reason)

    def _solve(
        self, base: NDArray[Any], target: NDArray[Any], psi: NDArray[Any], gradient: NDArray[Any], soft: bool
    ) -> tuple[NDArray[np.float64] | None, MathematicalProgramResult]:
        prog = MathematicalProgram()
        delta = prog.NewContinuousVariables(self.system.m, "du")
        prog.AddQuadraticErrorCost(np.eye(self.system.m), target - base, delta).evaluator().set_description(
            "nearest input"
        )
        limits = prog.AddBoundingBoxConstraint(self.lower - base, self.upper - base, delta)
        limits.evaluator().set_description("input limits")
        slack = prog.NewContinuousVariables(len(psi), "slack") if soft else np.zeros(0)
        if soft:
            prog.AddBoundingBoxConstraint(0.0, np.inf, slack).evaluator().set_description("slack")
            prog.AddQuadraticErrorCost(_SLACK_WEIGHT * np.eye(len(psi)), np.zeros(len(psi)), slack)
        for i, barrier in enumerate(self.barriers):
            norm = float(np.linalg.norm(gradient[i]))
            if norm > 0:  # otherwise it does not depend on the input at this state
                row = np.concatenate([gradient[i] / norm, [1.0] if soft else []])[np.newaxis]
                variables = np.concatenate([delta, slack[i : i + 1]])
                lower = np.array([(self.tightening - psi[i]) / norm])
                binding = prog.AddLinearConstraint(row, lower, np.array([np.inf]), variables)
                binding.evaluator().set_description(f"barrier {barrier.name}")
        result = ClarabelSolver().Solve(prog, None, _options())
        # A failed solve has no solution.
        return (np.asarray(result.GetSolution(delta)) if result.is_success() else None), result


def _options() -> SolverOptions:
    options = SolverOptions()
    for name in ("tol_gap_abs", "tol_gap_rel", "tol_feas"):
        options.SetOption(ClarabelSolver.id(), name, _TOLERANCE)
    return options
