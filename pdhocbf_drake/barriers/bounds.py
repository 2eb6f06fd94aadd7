"""Periodic bounds V̄(k): the moving limit of a barrier h(k, x) = ±(V̄(k) − n_k·x)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pdhocbf_drake.barriers.checks import finite_number, number_array, shown, whole_ticks
from pdhocbf_drake.barriers.config import BoundConfig, Side
from pdhocbf_drake.errors import InputError

_SHOWN_VALUES = 12  # a longer table is not shown in full
_LONGEST_PERIOD = 1_000_000  # [ticks]; a bound holds a table of one period


@dataclass(frozen=True)
class Bound:
    """A periodic sequence V̄(k), V̄(k+N) = V̄(k), as a table of one period; the bounded trajectory need not repeat.

    Attributes:
        values: V̄(0), …, V̄(N−1) [unit of the bounded quantity].

    Raises:
        InputError: no row of numbers, no values, or one that is not finite.
    """

    values: tuple[float, ...]

    def __post_init__(self) -> None:
        array = number_array("a bound", self.values)
        if array.ndim != 1 or array.dtype.kind not in "iuf":
            raise InputError(f"a bound is a list of numbers, one per tick, given {shown(self.values)}")
        if not array.size:
            raise InputError("a bound needs at least one value, given none")
        if not np.all(np.isfinite(array)):
            tick = int(np.flatnonzero(~np.isfinite(array))[0])
            raise InputError(f"a bound must be finite at every tick, given {array[tick]} at tick {tick}")
        object.__setattr__(self, "values", tuple(array.astype(float).tolist()))  # a list could still change

    @property
    def period(self) -> int:
        """N [ticks]."""
        return len(self.values)

    def __call__(self, k: int) -> float:
        try:
            return self.values[k % len(self.values)]
        except TypeError:
            whole_ticks("the tick k of a bound", k)
            raise

    def samples(self, k: int, n: int) -> NDArray[np.float64]:
        """V̄(k), …, V̄(k+n−1), shape (n,); raises `InputError` unless both are whole numbers."""
        return repeated(self.values, k, n)

    def __repr__(self) -> str:
        if len(self.values) <= _SHOWN_VALUES:
            return f"Bound({self.values})"
        least, largest = min(self.values), max(self.values)
        return f"Bound(<{len(self.values)} values from {least:g} to {largest:g}>)"


def repeated(table: ArrayLike, k: int, count: int) -> NDArray[Any]:
    """Entries k, …, k+count−1 of a table that repeats; raises `InputError` unless both are whole numbers."""
    try:
        return np.take(table, np.arange(k, k + count), axis=0, mode="wrap")
    except (TypeError, ValueError):  # checked only after a failure, because this runs at every tick
        whole_ticks("the tick k", k)
        whole_ticks("the number of ticks", count)
        raise


def constant(value: float) -> Bound:
    """V̄(k) = value: the plain DCBF's bound."""
    return Bound((value,))


def harmonic(mean: float, cosine: float, sine: float, period: int) -> Bound:
    """V̄(k) = mean + cosine·cos(2πk/N) + sine·sin(2πk/N), with N = `period` ticks.

    Raises:
        InputError: a coefficient is not finite, or the period is not a whole number from 1 to a million.
    """
    period = whole_ticks("the period of a bound", period, 1, _LONGEST_PERIOD)
    mean, cosine, sine = (finite_number("a coefficient of a harmonic bound", part) for part in (mean, cosine, sine))
    angle = 2 * np.pi * np.arange(period) / period
    return tabulated(mean + cosine * np.cos(angle) + sine * np.sin(angle))


def tabulated(values: ArrayLike) -> Bound:
    """V̄(k) = values[k mod N]: for instance one period of a recorded orbit plus a margin."""
    array = number_array("a tabulated bound", values)
    if array.ndim != 1:
        raise InputError(f"a tabulated bound is a list of numbers, one per tick, given shape {array.shape}")
    return Bound(tuple(array.tolist()))


def make_bound(
    config: BoundConfig, period: int, orbit: Sequence[float] | NDArray[Any] | None = None, side: Side = "upper"
) -> Bound:
    """The bound of a configuration.

    Args:
        config: the configuration.
        period: N, the period of the bounded quantity [ticks].
        orbit: its nominal orbit over one period, for the kinds "orbit" and "orbit_peak".
        side: the margin goes above the orbit for an upper bound, below it for a lower one.

    Raises:
        InputError: a table or an orbit does not repeat within the period, the orbit is missing, or the period is not
            a whole number of ticks.
    """
    period = whole_ticks("the period of a bound", period, 1)
    if config.kind == "constant":
        return constant(_given(config.value))
    if config.kind == "harmonic":
        return harmonic(_given(config.mean), config.cosine or 0.0, config.sine or 0.0, period)
    if config.kind == "tabulated":
        return _checked_period(tabulated(config.values or ()), period, "the tabulated bound")
    if orbit is None:
        raise InputError(f'bound kind "{config.kind}" needs the nominal orbit, which this system does not provide')
    nominal = _checked_period(tabulated(orbit), period, "the nominal orbit")
    outward, extreme = (config.margin or 0.0, max) if side == "upper" else (-(config.margin or 0.0), min)
    if config.kind == "orbit":
        return tabulated(np.asarray(nominal.values) + outward)
    return constant(extreme(nominal.values) + outward)


def _given(value: float | None) -> float:
    if value is None:  # possible in a copy of a BoundConfig made without validation
        raise InputError("the bound lacks a value that its kind needs")
    return value


def _checked_period(bound: Bound, period: int, what: str) -> Bound:
    if period % bound.period:
        raise InputError(f"{what} has {bound.period} values, but the period is {period} ticks: give a divisor of it")
    return bound
