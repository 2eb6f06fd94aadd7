"""A periodic linear system with polytopic limits that a user describes in a file, and its invariant sets."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from pdhocbf_drake.barriers import PeriodicAffineSystem
from pdhocbf_drake.config import Config, parse_config
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.sets.invariant_set import InvariantSet, invariant_set
from pdhocbf_drake.sets.polytope import Array, Polytope, bounding_box

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

    def polytope(self, size: int, where: str, fixed: bool = False) -> Polytope:
        """The polytope in `size` dimensions; raises `InputError`.

        Args:
            size: number of entries.
            where: for messages.
            fixed: whether entries with lower = upper are allowed; the polytope is then a face of a box, without volume.
        """
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
        still = np.zeros(size, dtype=bool)
        if self.lower is not None and self.upper is not None:
            still = np.array(self.lower) == np.array(self.upper)
            if still.any() and fixed:
                return _with_fixed(rows, bounds, still, np.array(self.lower), where)
        found = Polytope.from_rows(rows, bounds)
        if found is not None:
            return found
        if bounding_box(rows, bounds) is None:
            raise InputError(f"{where}: the limits leave nothing")
        which = f"entry {int(np.flatnonzero(still)[0])} is fixed" if still.any() else "the limits leave a flat set"
        raise InputError(f"{where}: {which}, but a set with an interior is needed")


class LinearSystemConfig(Config):
    """x(k+1) = A_k x(k) + B_k u(k) + c_k with x ∈ X_k and u ∈ U_k.

    Attributes:
        name: for messages and files.
        A, B, c: one matrix (vector) per phase, or a single one.
        states, inputs: X_k and U_k, one per phase or a single one.
    """

    name: str = "system"
    A: tuple[Matrix, ...] = Field(min_length=1)
    B: tuple[Matrix, ...] = Field(min_length=1)
    c: tuple[Vector, ...] = ()
    states: tuple[PolytopeConfig, ...] = Field(min_length=1)
    inputs: tuple[PolytopeConfig, ...] = Field(min_length=1)

    @classmethod
    def from_dict(cls, data: dict[str, Any], where: str) -> LinearSystemConfig:
        """A system from YAML data, where a part that is given once becomes a list of one; raises `InputError`."""
        depth = {"A": 3, "B": 3, "c": 2}
        wrapped = {key: [data[key]] for key in depth if key in data and _depth(data[key]) == depth[key] - 1}
        wrapped |= {key: [data[key]] for key in ("states", "inputs") if isinstance(data.get(key), dict)}
        return parse_config(cls, {**data, **wrapped}, where)

    def certify(self) -> InvariantSet:
        """The largest sets in which the system can be kept for ever; raises `InputError`."""
        try:
            system = PeriodicAffineSystem(np.array(self.A), np.array(self.B), np.array(self.c) if self.c else None)
        except ValueError as error:  # an InputError too, or rows of different lengths
            raise InputError(f"{self.name}: {error}") from None
        period = max(system.period, len(self.states), len(self.inputs))
        if any(period % count for count in (system.period, len(self.states), len(self.inputs))):
            raise InputError(f"{self.name}: A, B, c, states and inputs share one period or are given once")
        phases = range(period)
        system = PeriodicAffineSystem(*(np.array([part(k) for k in phases]) for part in (system.A, system.B, system.c)))
        states = [p.polytope(system.n, f"{self.name}.states.{i}") for i, p in enumerate(self.states)]
        inputs = [p.polytope(system.m, f"{self.name}.inputs.{i}", fixed=True) for i, p in enumerate(self.inputs)]
        return invariant_set(
            system, [states[k % len(states)] for k in phases], [inputs[k % len(inputs)] for k in phases]
        )


def _with_fixed(rows: Array, bounds: Array, still: NDArray[np.bool_], values: Array, where: str) -> Polytope:
    """{x : rows·x ≤ bounds} where some entries of x have one value: the polytope of the others, with these added."""
    left, free = bounds - rows[:, still] @ values[still], rows[:, ~still]
    among = np.any(free, axis=1)
    part = Polytope.from_rows(free[among], left[among]) if len(free.T) else None
    if np.any(left[~among] < 0) or (part is None and len(free.T)):
        raise InputError(f"{where}: the limits leave nothing")
    vertices = np.tile(np.where(still, values, 0.0), (1 if part is None else len(part.vertices), 1))
    if part is not None:
        vertices[:, ~still] = part.vertices
    return Polytope(rows, bounds, vertices)


def _depth(data: Any) -> int:
    return 1 + _depth(data[0]) if isinstance(data, (list, tuple)) and data else 0
