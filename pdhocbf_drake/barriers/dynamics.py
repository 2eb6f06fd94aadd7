"""Periodic discrete-time dynamics x(k+1) = f(k, x(k), u(k)), f(k+N, ·, ·) = f(k, ·, ·), eq. (1)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.autodiffutils import AutoDiffXd

from pdhocbf_drake.barriers.checks import finite_array, number_array, shown, vector, whole_ticks
from pdhocbf_drake.errors import InputError

Array = NDArray[Any]  # of floats, or of Drake's AutoDiffXd


@runtime_checkable
class PeriodicSystem(Protocol):
    """Dynamics that repeat every `period` ticks; 1 for time-invariant ones.

    Attributes:
        period: N [ticks].
        n: number of states.
        m: number of inputs.
        vouched: optional; true if `step` is not to be compared with itself one period on.
    """

    @property
    def period(self) -> int: ...
    @property
    def n(self) -> int: ...
    @property
    def m(self) -> int: ...

    def step(self, k: int, x: Array, u: Array) -> Array:
        """x(k+1) from x (n,) and u (m,), both floats or both AutoDiffXd: use operators and NumPy functions.

        Write into np.zeros_like(x) or np.array(x), which take both, and not into an array of floats.
        """
        ...


class PeriodicAffineSystem:
    """x(k+1) = A_k x(k) + B_k u(k) + c_k, with A, B, c of period N.

    Args:
        A: (N, n, n), or (n, n) for a constant one.
        B: (N, n, m), or (n, m).
        c: (N, n), or (n,), or None for zero.

    Raises:
        InputError: shapes that do not fit together, no state or no input, different periods, or an entry that is not
            a finite number.
    """

    def __init__(self, A: ArrayLike, B: ArrayLike, c: ArrayLike | None = None) -> None:
        a, b = finite_array("A", A), finite_array("B", B)
        a = a[np.newaxis] if a.ndim == 2 else a
        b = b[np.newaxis] if b.ndim == 2 else b
        if a.ndim != 3 or a.shape[1] != a.shape[2] or not a.size:
            raise InputError(f"A must have shape (period, n, n) or (n, n), given {np.shape(A)}")
        n = a.shape[1]
        if b.ndim != 3 or b.shape[1] != n or not b.size:
            raise InputError(f"B must have shape (period, {n}, m) or ({n}, m), given {np.shape(B)}")
        offset = np.zeros((1, n)) if c is None else finite_array("c", c)
        offset = offset[np.newaxis] if offset.ndim == 1 else offset
        if offset.ndim != 2 or offset.shape[1] != n or not offset.size:
            raise InputError(f"c must have shape (period, {n}) or ({n},), given {offset.shape}")
        period = max(len(a), len(b), len(offset))
        for name, part in (("A", a), ("B", b), ("c", offset)):
            if len(part) not in (1, period):
                raise InputError(f"A, B and c share one period, or are constant: {name} has {len(part)}, not {period}")
        self._A, self._B, self._c = (np.repeat(p, period // len(p), axis=0) for p in (a, b, offset))
        for part in (self._A, self._B, self._c):
            part.flags.writeable = False  # A(k) is a view

    @classmethod
    def from_drake(cls, system: Any) -> PeriodicAffineSystem:
        """The dynamics of a discrete-time pydrake `LinearSystem` or `AffineSystem`; raises `InputError` for others."""
        if not all(hasattr(system, part) for part in ("time_period", "A", "B")):
            raise InputError(f"a pydrake LinearSystem or AffineSystem is needed, given {shown(system)}")
        if system.time_period() <= 0:
            raise InputError("the system has continuous time (time_period 0): discretise it first")
        return cls(system.A(), system.B(), system.f0() if hasattr(system, "f0") else None)

    @property
    def period(self) -> int:
        """N [ticks]."""
        return len(self._A)

    @property
    def n(self) -> int:
        """Number of states."""
        return int(self._A.shape[1])

    @property
    def m(self) -> int:
        """Number of inputs."""
        return int(self._B.shape[2])

    def A(self, k: int) -> Array:
        """A_k, (n, n), not to be written to."""
        return self._at(self._A, k)

    def B(self, k: int) -> Array:
        """B_k, (n, m), not to be written to."""
        return self._at(self._B, k)

    def c(self, k: int) -> Array:
        """c_k, (n,), not to be written to."""
        return self._at(self._c, k)

    def step(self, k: int, x: Array, u: Array) -> Array:
        """x(k+1), eq. (1)."""
        return self.A(k) @ x + self.B(k) @ u + self.c(k)

    @staticmethod
    def _at(table: Array, k: int) -> Array:
        try:
            return np.asarray(table[k % len(table)])
        except (TypeError, IndexError):  # checked only after a failure, because this runs at every tick
            whole_ticks("the tick k", k)
            raise


def check_system(system: Any) -> PeriodicSystem:
    """The system itself; raises `InputError` unless it has `period`, `n` and `m`, whole and positive, and `step`."""
    for part, what in (("period", "the period"), ("n", "the number of states"), ("m", "the number of inputs")):
        if not hasattr(system, part):
            raise InputError(f"a system has period, n, m and step(k, x, u), given {shown(system)} without {part}")
        value = getattr(system, part)
        if not isinstance(value, (int, np.integer)) or isinstance(value, bool) or value < 1:
            raise InputError(f"the system: {what} is a whole number, at least 1, given {shown(value)}")
    if not callable(getattr(system, "step", None)):
        raise InputError(f"a system has period, n, m and step(k, x, u), given {shown(system)} without step")
    return system


def next_state(system: PeriodicSystem, k: int, x: Array, u: Array) -> Array:
    """x(k+1) = step(k, x, u), (n,); raises `InputError` for any other answer."""
    after = system.step(k, x, u)
    return after if type(after) is np.ndarray and after.shape == (system.n,) else _state(after, system.n)


def _state(after: Any, n: int) -> Array:
    return vector("the system's step: x(k+1)", after, n)


def rollout(system: PeriodicSystem, k: int, x: ArrayLike, inputs: Sequence[Any] | Array) -> Array:
    """x(k), …, x(k+T), shape (T+1, n), from x(k) (n,) under the T inputs u(k), …, u(k+T−1).

    Args:
        inputs: as `input_rows` takes them; like x they may be AutoDiffXd.

    Raises:
        InputError: shapes that do not fit the system, or a tick that is not a whole number.
    """
    if not (isinstance(getattr(system, "n", None), int) and isinstance(getattr(system, "m", None), int)):
        check_system(system)
    k, state, rows = whole_ticks("the tick k", k), vector("the state x", x, system.n), input_rows(system, inputs)
    # Arrays of whole numbers would round what a step writes into their like.
    state, rows = (array.astype(float) if array.dtype.kind in "iub" else array for array in (state, rows))
    if state.dtype == object or rows.dtype != object:
        return _along(system, k, state, rows)
    try:
        return _along(system, k, state, rows)
    except (TypeError, ValueError):  # a step that writes AutoDiffXd into an array made from floats
        return _along(system, k, _lifted(state), _lifted(rows), lift=True)


def _along(system: PeriodicSystem, k: int, state: Array, rows: Array, lift: bool = False) -> Array:
    states = [state]
    for i, u in enumerate(rows):  # of copies, since a step may write into its arguments
        after = next_state(system, k + i, states[-1].copy(), u.copy())
        states.append(_lifted(after) if lift else after)
    return np.array(states)


def _lifted(array: Array) -> Array:
    """The array with AutoDiffXd for each number; symbolic entries stay as they are."""
    entries = [AutoDiffXd(float(entry)) if isinstance(entry, (float, int)) else entry for entry in array.flat]
    return np.array(entries, dtype=object).reshape(array.shape)


def input_rows(system: PeriodicSystem, inputs: ArrayLike | Sequence[Any]) -> Array:
    """Inputs of T ticks as an array (T, m), from one of that shape or from its entries in a row, (T·m,).

    Raises:
        InputError: another shape, or no numbers.
    """
    given = number_array("the inputs", inputs)
    if not given.size:
        return np.zeros((0, system.m))
    if (given.ndim == 2 and given.shape[1] == system.m) or (given.ndim == 1 and given.size % system.m == 0):
        return given.reshape(-1, system.m)
    raise InputError(f"the inputs must have shape (T, {system.m}), given {given.shape}")
