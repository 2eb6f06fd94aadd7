"""What is declared periodic is compared one period on: h(k+N, ·) with h(k, ·), and step(k+N, ·, ·) with step(k, ·, ·).

A comparison can't prove that a function repeats, but it finds a drift, a wrong period and a forgotten modulo. Its
tolerance is relative, so that units do not matter: 1e-9 of the largest value at the same point, or 1e-12 of the
largest at any of the compared points, which is the rounding of terms that cancel.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.barriers.checks import one_number, shown
from pdhocbf_drake.errors import InputError

if TYPE_CHECKING:
    from pdhocbf_drake.barriers.dynamics import PeriodicSystem

_SAME_POINT, _ANY_POINT = 1e-9, 1e-12
_RANDOM = np.random.default_rng(0).standard_normal((2, 64))

Function = Callable[[int, NDArray[np.float64]], Any]  # of the tick and a sampled point


def check_h_repeats(name: str, h: Function, k: int, period: int, x: NDArray[np.float64]) -> None:
    """Compares h(k+N, ·) with h(k, ·) at the state x and at two random ones of its magnitude.

    Raises:
        InputError: they differ, with both values; h gives no number; or it raises an exception a period on.
    """
    where = f'barrier "{name}": h'
    scale = float(np.max(np.abs(x), initial=0.0)) or 1.0
    points = [x, *(scale * np.resize(row, x.size) for row in _RANDOM)]
    vouch = "with vouched=True the ticks 0, ..., N-1 are repeated without a comparison"
    _compare(where, lambda tick, state: [float(one_number(where, h(tick, state)))], k, period, points, vouch)


def check_step_repeats(system: PeriodicSystem, k: int, states: NDArray[Any], inputs: NDArray[Any]) -> None:
    """Compares step(k+N, x, u) with step(k, x, u) at sampled states (S, n) and inputs (S, m).

    A system with an attribute `vouched` that is true is not compared.

    Raises:
        InputError: they differ, with both values; or `step` raises an exception a period on.
    """
    if getattr(system, "vouched", False):
        return

    def step(tick: int, point: NDArray[np.float64]) -> Any:
        return np.asarray(system.step(tick, point[: system.n], point[system.n :]), dtype=float).ravel()

    vouch = "a system with the attribute vouched = True is not compared"
    _compare("the system's step", step, k, system.period, list(np.hstack([states, inputs])), vouch)


def _compare(
    where: str, function: Function, k: int, period: int, points: list[NDArray[np.float64]], vouch: str
) -> None:
    others = {k + period // 3, k + period // 2} - {k}  # for the magnitude at each point
    later = (k + period, k + 101 * period)  # the second one finds what begins late or drifts slowly
    values, used = [], []
    with np.errstate(all="ignore"):
        for point in points:
            try:
                near = [function(tick, point.copy()) for tick in (k, *others)]
            except Exception:
                continue  # the function is not defined here, which who calls it will find where it matters
            used.append(point)
            try:
                values.append([*(function(tick, point.copy()) for tick in later), *near])
            except Exception as error:
                raise InputError(
                    f"{where} is declared with a period of {period} ticks and raised {type(error).__name__} ({error}) "
                    f"at tick {later[0]} or {later[1]}; it must take any tick: use k % N, or {vouch}"
                ) from error
        if not used:
            return
        found = np.array(values)  # (points, ticks, entries)
        here, after = found[:, 2:3], found[:, :2]
        size = np.abs(found).max(axis=1, keepdims=True)
        largest = np.where(np.isfinite(size), size, 0.0).max(axis=0)
        wrong = np.abs(after - here) > np.maximum(_SAME_POINT * size, _ANY_POINT * largest)
    if wrong.any():  # NaN, where the function is not defined, is no difference
        point, tick, entry = np.argwhere(wrong)[0]
        raise InputError(
            f"{where} does not repeat with its period of {period} tick{'s' * (period > 1)}: it is "
            f"{here[point, 0, entry]:.9g} at tick {k} and {after[point, tick, entry]:.9g} at tick {later[tick]}, "
            f"at {shown(used[point].tolist())}; {vouch}"
        )
