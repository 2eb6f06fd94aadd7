"""The barriers of a scenario's walk, each with its bound, and the refusal of what a walk could not keep."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from pdhocbf_drake.barriers import Bound, check_in_safe_set, check_relative_degree, constant, make_bound
from pdhocbf_drake.barriers.config import Side
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.barrier_config import WalkBarrierConfig
from pdhocbf_drake.walking.quantities import Quantity
from pdhocbf_drake.walking.vhip import Vhip
from pdhocbf_drake.walking.walk_barrier import CommandOrbits, WalkBarrier, make_walk_barrier

AT_REST = np.zeros((2, 3))  # [c, v, p] per axis from the middle between the feet


def barrier_of(
    name: str, config: WalkBarrierConfig, gait: Gait, vhip: Vhip, nominal: Sequence[tuple[float, np.ndarray]],
    orbits: CommandOrbits | None,
) -> WalkBarrier:  # fmt: skip
    """One barrier; raises `InputError`.

    Args:
        nominal: the nominal walks (2, 2N, 3) that its bound follows, each with the rise of its steps [m]: the outer
            envelope of their orbits; none for other bounds.
        orbits: those of a walk that follows commands. Where the bound follows them, the barrier's own one is that of
            a speed in a stand.
    """
    quantity = config.bounded
    if orbits is not None and orbits.margin is not None:
        bound = constant(orbits.margin if config.side == "upper" else -orbits.margin)
        return make_walk_barrier(name, config, vhip, gait, bound, True, orbits)
    with naming(name):
        orbit = _envelope(quantity, config.side, gait, nominal)
        bound = _bound(config, quantity.period(vhip.period), gait.config.ticks_per_gait, orbit)
        farthest = max(bound.values, key=abs)
        if abs(farthest) > quantity.largest:
            raise InputError(f"a bound may be {quantity.largest:g} {quantity.unit} at most, this one is {farthest:g}")
    at_rest = config.quantity is not None
    barrier = make_walk_barrier(name, config, vhip, gait, bound, at_rest, orbits)
    check_relative_degree(barrier, vhip.system)
    if not at_rest:
        try:
            check_in_safe_set(barrier, vhip.system, 0, AT_REST[quantity.axis])
        except InputError as error:
            raise InputError(f"{error}{_rest_hint(config.side, bound)}") from None
    return barrier


def _envelope(
    quantity: Quantity, side: Side, gait: Gait, nominal: Sequence[tuple[float, np.ndarray]]
) -> np.ndarray | None:
    """The outer one of a quantity's values on several nominal walks, at each tick of its period."""
    found = [quantity.orbit(w, Vhip(gait.eta(rise), gait.config.tick), gait.config, side) for rise, w in nominal]
    orbits = [orbit for orbit in found if orbit is not None]
    if not orbits:
        return None
    return np.asarray(np.max(orbits, axis=0) if side == "upper" else np.min(orbits, axis=0))


def _bound(config: WalkBarrierConfig, period: int, gait: int, orbit: np.ndarray | None) -> Bound:
    """The bound of a quantity that repeats after `period` ticks; a table may also repeat after a gait."""
    values = config.bound.values or ()
    if config.bound.kind == "tabulated" and len(values) != gait and period % len(values):
        step = gait // 2
        raise InputError(
            f"the tabulated bound has {len(values)} values, but a bound repeats after a step of {step} ticks or after "
            f"two: give {step} or {gait}, or a divisor of {period}"
        )
    return make_bound(config.bound, gait if len(values) == gait else period, orbit, config.side)


@contextmanager
def naming(name: str) -> Iterator[None]:
    """Puts the name of the barrier before the message of an error inside."""
    try:
        yield
    except InputError as error:
        raise InputError(f'barrier "{name}": {error}') from None


def _rest_hint(side: str, bound: Bound) -> str:
    """The correction of a bound that excludes 0, the quantity's value at rest."""
    if side == "upper" and min(bound.values) < 0:
        return "; a walk starts at rest, which an upper bound below 0 leaves out: for a backward walk use side: lower"
    if side == "lower" and max(bound.values) > 0:
        return "; a walk starts at rest, which a lower bound above 0 leaves out"
    return ""
