"""A parametric quadratic program as arrays, and its answer at one θ."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.qp.affine_map import AffineMap, QuadraticForm


@dataclass(frozen=True)
class ParametricQp:
    """min ½ wᵀP w + f(θ)ᵀw + constant(θ)  s.t.  lower(θ) ≤ A w ≤ upper(θ), with f, lower and upper affine in θ.

    Attributes:
        P: shape (n, n).
        A: shape (m, n).
        linear: f, θ → (n,).
        lower, upper: θ → (m,); infinite entries stand for no bound.
        names: for each row of A, the description of the constraint that it comes from.
        constant: the part of the cost that depends on θ alone, θ → number.
    """

    P: np.ndarray
    A: np.ndarray
    linear: AffineMap
    lower: AffineMap
    upper: AffineMap
    names: tuple[str, ...]
    constant: QuadraticForm

    def vectors(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """f (n,), lower (m,) and upper (m,) at θ.

        Raises:
            InputError: θ has another length than the parameters.
        """
        return self.linear(theta), self.lower(theta), self.upper(theta)


class QpResult(NamedTuple):
    """The answer of a solver at one θ.

    Attributes:
        ok: whether `decisions` is an optimum.
        decisions: w, shape (n,); without meaning unless `ok`.
        cost: the optimal cost, constant(θ) included.
        active: for each row of A +1 where its upper bound is active, −1 for its lower bound, else 0, shape (m,).
        infeasible: whether the solver proved that no w meets the constraints.
        status: the solver's message, "optimal" if `ok`.
    """

    ok: bool
    decisions: np.ndarray
    cost: float
    active: np.ndarray
    infeasible: bool
    status: str
