"""A barrier: a periodic function h(k, x) that is to stay ≥ 0, and its class-K functions."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from copy import copy
from math import lcm
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.autodiffutils import AutoDiffXd

from pdhocbf_drake.barriers.bounds import Bound, repeated
from pdhocbf_drake.barriers.checks import finite_array, is_number, one_number, shown, whole_ticks
from pdhocbf_drake.barriers.class_k import ClassK, as_class_k, check_class_k
from pdhocbf_drake.barriers.config import BarrierConfig
from pdhocbf_drake.barriers.dynamics import Array
from pdhocbf_drake.barriers.periodicity import check_h_repeats
from pdhocbf_drake.errors import InputError


class Barrier:
    """The safe set C(k) = {x : h(k, x) ≥ 0}, h(k+N, x) = h(k, x), eqs. (8)–(11).

    `h` takes any tick k. At the first use of each phase it is compared with itself one period and 101 periods on, at
    the state at hand and two random ones of its magnitude: up to 15 evaluations, once for each phase that is used.

    Attributes:
        name: for rows, logs and messages.
        period: N of h [ticks]; a trajectory need not repeat.
        class_k: α_1, …, α_m; a plain number γ means α(s) = γ·s.
        order: m, the number of class-K functions; a controller enforces ψ_m(k) ≥ 0.
        relative_degree: declared number of ticks after which an input acts on h; by default m. If it is larger than m,
            no input acts on the first ψ_m, and ψ_m ≥ 0 is enforced from the first tick on at which one does.
        unit: unit of h.
        vouched: h repeats by the word of its author: only h(0, ·), …, h(N−1, ·) are used, and nothing is compared.
            For an h that looks up a table of one period, or that is expensive.

    Raises:
        InputError: h can't be called with a tick and a state; there is no class-K function, or one without Lemma 1;
            or the period or the relative degree is impossible.
    """

    def __init__(
        self,
        name: str,
        h: Callable[[int, Array], Any],
        period: int,
        class_k: Sequence[ClassK | float],
        unit: str = "",
        relative_degree: int | None = None,
        vouched: bool = False,
    ) -> None:
        if not (callable(h) and _takes_two(h)):
            raise InputError(f'barrier "{name}": h is a function of the tick k and the state x, given {_described(h)}')
        if not np.iterable(class_k):
            raise InputError(f'barrier "{name}": the class-K functions are a list, given {shown(class_k)}')
        class_k = tuple(class_k)
        if len(class_k) == 0:
            raise InputError(f'barrier "{name}": at least one class-K function is needed, given none')
        self.name = name
        self.period = whole_ticks(f'barrier "{name}": the period', period, 1)
        self.class_k = tuple(as_class_k(alpha) for alpha in class_k)
        for i, alpha in enumerate(self.class_k, start=1):
            check_class_k(alpha, f'barrier "{name}", class-K function {i}')
        self.order = len(self.class_k)
        declared = self.order if relative_degree is None else relative_degree
        self.relative_degree = whole_ticks(f'barrier "{name}": the declared relative degree', declared, 1)
        if self.relative_degree < self.order:
            raise InputError(
                f'barrier "{name}": {self.order} class-K functions are given for a declared relative degree of '
                f"{self.relative_degree}, but at most that many are allowed (else psi_i holds inputs for some i < m)"
            )
        self.unit = unit
        self.vouched = vouched
        self._h = h
        self._compared: set[int] = set()  # the phases at which h was found to repeat

    def h(self, k: int, x: Array) -> Any:
        """h(k, x) [unit]; x (n,) may hold floats or AutoDiffXd.

        Raises:
            InputError: h gives something else than one number, or does not repeat; k is not a whole number.
        """
        phase = (k if type(k) is int else whole_ticks("the tick k", k)) % self.period
        if not self.vouched and phase not in self._compared and (state := _finite_floats(x)) is not None:
            check_h_repeats(self.name, self._h, phase, self.period, state)
            self._compared.add(phase)
        value = self._h(phase, x)
        return value if isinstance(value, (float, AutoDiffXd)) else one_number(f'barrier "{self.name}": h', value)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.name!r}, period={self.period}, class_k={self.class_k})"


class AffineBarrier(Barrier):
    """h(k, x) = s·(V̄(k) − n_k·x), eqs. (18) and (25): the safe set is a half-space that moves.

    Attributes:
        normal: n, shape (n,), if it is constant; otherwise n_0, …, n_{P−1}, shape (P, n), with n_{k+P} = n_k.
        bound: V̄(k) [unit].
        sign: s = +1 keeps n_k·x under the bound, −1 above it.

    Raises:
        InputError: as `Barrier`; a normal that is zero or not finite; a bound that is no `Bound`; or a sign other
            than ±1.
    """

    def __init__(
        self,
        name: str,
        normal: ArrayLike,
        bound: Bound,
        sign: int,
        class_k: Sequence[ClassK | float],
        unit: str = "",
        relative_degree: int | None = None,
    ) -> None:
        given = finite_array(f'barrier "{name}": the normal', normal)
        normals = np.array(given, ndmin=2)
        self.bound = bound
        self.sign = sign
        if given.ndim not in (1, 2) or not given.size or not np.all(np.any(normals, axis=1)):
            raise InputError(f'barrier "{name}": the normal must be a vector other than zero, given {shown(normal)}')
        if not isinstance(bound, Bound):
            raise InputError(
                f'barrier "{name}": the bound is made by constant, harmonic or tabulated, given {shown(bound)}'
            )
        if not (is_number(sign) and sign in (1, -1)):
            raise InputError(f'barrier "{name}": the sign is +1 (upper bound) or -1 (lower bound), given {shown(sign)}')
        normals.flags.writeable = False
        self._normals, self.normal = normals, normals[0] if len(normals) == 1 else normals
        super().__init__(name, self._affine, lcm(bound.period, len(normals)), class_k, unit, relative_degree, True)

    @property
    def normal_period(self) -> int:
        """P [ticks]; 1 for a constant normal."""
        return len(self._normals)

    def normals(self, k: int, count: int) -> NDArray[np.float64]:
        """n_k, …, n_{k+count−1}, shape (count, n)."""
        return repeated(self._normals, k, count)

    def with_class_k(self, class_k: Sequence[ClassK | float]) -> AffineBarrier:
        """The same h with as many other class-K functions."""
        other = copy(self)
        other.class_k = tuple(as_class_k(alpha) for alpha in class_k)
        return other

    def check_fits(self, states: int) -> None:
        """Raises `InputError`, with both numbers, unless the system has as many states as the normal has entries."""
        entries = self._normals.shape[1]
        if entries != states:
            raise InputError(f'barrier "{self.name}": the normal has {entries} entries, but the system {states} states')

    def _affine(self, k: int, x: Array) -> Any:
        try:
            return self.sign * (self.bound(k) - self._normals[k % len(self._normals)] @ x)
        except ValueError:  # checked only after a failure, because h is evaluated at every tick
            self.check_fits(np.size(x))
            raise


def _takes_two(h: Callable[..., Any]) -> bool:
    try:
        inspect.signature(h).bind(0, None)
    except TypeError:
        return False
    except ValueError:  # a function of compiled code, without a signature
        return True
    return True


def _described(h: Any) -> str:
    return f"one that takes {inspect.signature(h)}" if callable(h) else shown(h)


def _finite_floats(x: Any) -> NDArray[np.float64] | None:
    """The values of a state of floats or AutoDiffXd, or None where they are not finite, or symbolic."""
    try:
        values = np.array([entry.value() if hasattr(entry, "derivatives") else entry for entry in x], dtype=float)
    except (TypeError, ValueError, RuntimeError):
        return None
    return values if values.ndim == 1 and np.all(np.isfinite(values)) else None


def make_barrier(name: str, config: BarrierConfig, normal: ArrayLike, bound: Bound) -> AffineBarrier:
    """The barrier of a configuration on the quantity n_k·x; `normal` as in `AffineBarrier`."""
    sign = 1 if config.side == "upper" else -1
    return AffineBarrier(name, normal, bound, sign, config.make_class_k(), config.unit, config.relative_degree)
