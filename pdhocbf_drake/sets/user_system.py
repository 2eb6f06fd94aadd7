"""A periodic linear system with polytopic limits that a user describes in a file, and its invariant sets."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from pydantic import Field, model_validator

from pdhocbf_drake.barriers import PeriodicAffineSystem
from pdhocbf_drake.config import Config, parse_config
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.sets.disturbance import Largest, checked_half_widths, largest_disturbance
from pdhocbf_drake.sets.flat import flat_polytope, flat_predecessor, positive
from pdhocbf_drake.sets.invariant_set import InvariantSet, invariant_set
from pdhocbf_drake.sets.polytope import Array, Polytope

Vector = tuple[float, ...]
Matrix = tuple[Vector, ...]


class PolytopeConfig(Config):
    """{x : lower ≤ x ≤ upper, rows·x ≤ bounds}; either part may be left out, but together they must be bounded.

    Attributes:
        lower, upper: a box [unit of each entry].
        rows, bounds: further half-spaces.
    """

    lower: Vector | None = None
    upper: Vector | None = None
    rows: Matrix = ()
    bounds: Vector = ()

    @model_validator(mode="after")
    def _fits(self) -> PolytopeConfig:
        if (self.lower is None) != (self.upper is None):
            raise ValueError("lower and upper are given together or not at all")
        if len(self.rows) != len(self.bounds):
            raise ValueError(f"as many rows as bounds are needed, not {len(self.rows)} and {len(self.bounds)}")
        return self

    def polytope(self, size: int, where: str) -> Polytope:
        """The polytope of `size` entries, flat where the limits fix some of them; raises `InputError`."""
        A, b = [np.zeros((0, size))], [np.zeros(0)]
        if self.lower is not None and self.upper is not None:
            A += [np.eye(size), -np.eye(size)]
            b += [np.array(self.upper), -np.array(self.lower)]
        if self.rows:
            A.append(np.array(self.rows))
            b.append(np.array(self.bounds))
        if any(part.shape[1] != size for part in A) or any(len(x) != len(y) for x, y in zip(A, b, strict=True)):
            raise InputError(f"{where}: every limit must have {size} entries")
        if not sum(len(part) for part in A):
            raise InputError(f"{where}: give lower and upper, or rows and bounds")
        rows, bounds = np.vstack(A), np.concatenate(b)
        try:
            found = Polytope.from_rows(rows, bounds) or flat_polytope(rows, bounds)
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
        if found is None:
            raise InputError(f"{where}: the limits leave nothing")
        return found


class LinearSystemConfig(Config):
    """x(k+1) = A_k x(k) + B_k u(k) + c_k + w(k) with x ∈ X_k, u ∈ U_k and w ∈ W_k.

    Attributes:
        name: for messages and files.
        A, B, c: one matrix (vector) per phase, or a single one.
        states, inputs: X_k and U_k, one per phase or a single one.
        disturbance: W_k, which holds 0, one per phase or a single one; none for an undisturbed system.
    """

    name: str = "system"
    A: tuple[Matrix, ...] = Field(min_length=1)
    B: tuple[Matrix, ...] = Field(min_length=1)
    c: tuple[Vector, ...] = ()
    states: tuple[PolytopeConfig, ...] = Field(min_length=1)
    inputs: tuple[PolytopeConfig, ...] = Field(min_length=1)
    disturbance: tuple[PolytopeConfig, ...] = ()

    @classmethod
    def from_dict(cls, data: dict[str, Any], where: str) -> LinearSystemConfig:
        """A system from YAML data, where a part that is given once becomes a list of one; raises `InputError`."""
        depth = {"A": 3, "B": 3, "c": 2}
        wrapped = {key: [data[key]] for key in depth if key in data and _depth(data[key]) == depth[key] - 1}
        wrapped |= {key: [data[key]] for key in ("states", "inputs", "disturbance") if isinstance(data.get(key), dict)}
        return parse_config(cls, {**data, **wrapped}, where)

    def problem(self) -> tuple[PeriodicAffineSystem, list[Polytope], list[Polytope]]:
        """Dynamics, X_k and U_k at every phase; raises `InputError`."""
        try:
            system = PeriodicAffineSystem(np.array(self.A), np.array(self.B), np.array(self.c) if self.c else None)
        except ValueError as error:  # an InputError too, or rows of different lengths
            raise InputError(f"{self.name}: {error}") from None
        counts = system.period, len(self.states), len(self.inputs), len(self.disturbance) or 1
        period = max(counts)
        if any(period % count for count in counts):
            raise InputError(f"{self.name}: A, B, c, states, inputs and disturbance share one period or are given once")
        phases = range(period)
        system = PeriodicAffineSystem(*(np.array([part(k) for k in phases]) for part in (system.A, system.B, system.c)))
        states = [p.polytope(system.n, f"{self.name}.states.{i}") for i, p in enumerate(self.states)]
        inputs = [p.polytope(system.m, f"{self.name}.inputs.{i}") for i, p in enumerate(self.inputs)]
        return system, [states[k % len(states)] for k in phases], [inputs[k % len(inputs)] for k in phases]

    def disturbed_by(self, half_widths: Sequence[float]) -> LinearSystemConfig:
        """The same system under |w_i| ≤ the i-th half-width; raises `InputError` for another number of them."""
        states = len(self.A[0])
        sides = checked_half_widths(half_widths, states, f"{self.name}: one for each state")
        return self.model_copy(
            update={"disturbance": (PolytopeConfig(lower=tuple(-side for side in sides), upper=sides),)}
        )

    def disturbances(self, scale: float = 1.0) -> list[Array]:
        """Corners of a multiple of W_k at every phase, each (w, n); none without a disturbance; raises `InputError`."""
        system = self.problem()[0]
        corners = []
        for i, part in enumerate(self.disturbance):
            where = f"{self.name}.disturbance.{i}"
            found = part.polytope(system.n, where)
            if found.violation(np.zeros(system.n)) > 0.0:
                raise InputError(f"{where}: a disturbance may be 0; a constant part of it belongs into c")
            corners.append(scale * found.vertices)
        return [corners[k % len(corners)] for k in range(system.period)] if corners else []

    def certify(self, scale: float = 1.0, within: Sequence[Polytope] = ()) -> InvariantSet:
        """The largest sets in which the system can be kept for ever under a multiple of W_k; raises `InputError`.

        Args:
            within: as in `invariant_set`.
        """
        return invariant_set(*self.problem(), disturbance=self.disturbances(scale), within=within)

    def largest(self, here: InvariantSet) -> Largest:
        """The largest multiple of W_k under which it can, from the sets at 1 on."""
        return largest_disturbance(self.certify, ((1.0, here),))

    def lost_state(self) -> str | None:
        """Which fixed state is lost, from any state within the limits, by whatever input; None if there is none.

        It is where the disturbance moves it, or no input brings it to its value.
        """
        system, states, inputs = self.problem()
        for k, corners in enumerate(self.disturbances()):
            fixed = states[(k + 1) % system.period].unit == 0.0
            for i in np.flatnonzero(fixed & np.any(corners, axis=0)):
                return f"the disturbance moves state {i}, which is fixed at phase {(k + 1) % system.period}"
        for k in range(system.period):
            after = (k + 1) % system.period
            there = states[after]
            for i in np.flatnonzero(there.unit == 0.0):
                value, row = there.centre[i], np.eye(system.n)[[i]]
                only = np.vstack([row, -row]), np.array([value, -value])
                if flat_predecessor(system, k, states[k], inputs[k], only, positive(there.unit, there.centre)) is None:
                    return f"no input brings state {i} to {value:g}, where it is fixed at phase {after}"
        return None


def _depth(data: Any) -> int:
    return 1 + _depth(data[0]) if isinstance(data, (list, tuple)) and data else 0
