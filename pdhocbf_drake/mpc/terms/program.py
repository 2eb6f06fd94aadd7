"""The `MathematicalProgram` of one axis at one phase of the step, while its terms are written into it."""

from __future__ import annotations

import numpy as np
from pydrake.solvers import Constraint, LinearConstraint, LinearEqualityConstraint, MathematicalProgram

from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.vhip import Vhip


class AxisProgram:
    """The QP of one axis at one phase of the step, eq. (36), with θ as variables.

    Decisions w = [u_0 … u_{H−1} (ZMP velocities [m/s]), f_1 … (centres of the coming stance feet [m]), slacks].

    Attributes:
        prog: what is written.
        tick, phase: tick of the gait, and of the step, at which the plan begins.
        period, horizon: N and H [ticks].
        u, f: ZMP velocities and footholds.
        part: the parameters by name, as variables.
        feet: [last, this, coming stance centres].
        weights: of the box centre in `feet`, see `SupportRegion.weights`, (H, n_f + 2).
        stances: which of `feet` is the stance at k + i, i = 0 … H: 1 for that one, else 0, (H + 1, n_f + 2).
        phi, gamma: Φ, Γ with [c, v, p](k + i) = Φ_i [c, v, p](k) + Γ_i u, see `Vhip.prediction`.
    """

    def __init__(self, gait: Gait, vhip: Vhip, tick: int, horizon: int, places: dict[str, slice]) -> None:
        self.period = gait.period
        phase = tick % gait.period
        self.tick, self.phase, self.horizon = tick, phase, horizon
        self.prog = MathematicalProgram()
        self.u = self.prog.NewContinuousVariables(horizon, "u")
        self.f = self.prog.NewContinuousVariables(horizon // gait.period, "f")
        self.parameters = self.prog.NewContinuousVariables(max(place.stop for place in places.values()), "theta")
        self.part = {name: self.parameters[place] for name, place in places.items()}
        self.feet = np.concatenate([self.part["stance"], self.f])
        self.phi, self.gamma = vhip.prediction(phase, horizon)
        self.weights = gait.region.weights(phase, horizon, len(self.f))
        self.stances = np.eye(len(self.feet))[1 + (phase + np.arange(horizon + 1)) // gait.period]
        self._slacks: list[np.ndarray] = []

    @property
    def decisions(self) -> np.ndarray:
        """w, slacks in the order in which they were added."""
        return np.concatenate([self.u, self.f, *self._slacks])

    def new_slacks(self, count: int, name: str) -> np.ndarray:
        """More decisions."""
        self._slacks.append(self.prog.NewContinuousVariables(count, name))
        return self._slacks[-1]

    def price(self, hessian: np.ndarray, variables: np.ndarray, name: str, linear: np.ndarray | None = None) -> None:
        """Adds the cost ½ xᵀ hessian x + linearᵀ x, convex as it is written, which Drake need not find out."""
        slope = np.zeros(len(hessian)) if linear is None else linear
        self.prog.AddQuadraticCost(hessian, slope, variables, True).evaluator().set_description(name)

    def at_least(self, rows: np.ndarray, variables: np.ndarray, name: str, lower: np.ndarray | None = None) -> None:
        """Adds rows · variables ≥ lower, or ≥ 0."""
        least = np.zeros(len(rows)) if lower is None else lower
        self._constrain(LinearConstraint(rows, least, np.full(len(rows), np.inf)), variables, name)

    def equal_zero(self, rows: np.ndarray, variables: np.ndarray, name: str) -> None:
        """Adds rows · variables = 0."""
        self._constrain(LinearEqualityConstraint(rows, np.zeros(len(rows))), variables, name)

    def _constrain(self, constraint: Constraint, variables: np.ndarray, name: str) -> None:
        """`prog.AddLinearConstraint` would do the same, but loads scipy to see whether its matrix is sparse."""
        constraint.set_description(name)
        self.prog.AddConstraint(constraint, variables)
