"""A periodic bound V̄(k) designed from a recorded walk: the extreme at each phase, plus a margin."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from scipy.optimize import linprog

from pdhocbf_drake.analysis.barrier_margins import measured, planned
from pdhocbf_drake.barriers.config import Side
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.sets.polytope import Array
from pdhocbf_drake.simulation.checks import check_straight
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.walking.barrier_config import WalkBoundConfig
from pdhocbf_drake.walking.quantities import Quantity

Kind = Literal["tabulated", "harmonic"]

_DIGITS = 1e5  # bounds are rounded outwards to 1e-5 of the quantity's unit
_FEWEST = 3  # periods from which a variability can be read


class Envelope(NamedTuple):
    """The values of a quantity of a recorded walk at each phase of its period.

    Attributes:
        quantity: the quantity.
        mean: shape (period,) [its unit].
        outer: the largest value for an upper bound, the smallest for a lower one, shape (period,) [its unit].
        planned: as outer, of what was planned for the next tick, shape (period,) [its unit].
        spread: the largest distance of outer from mean [its unit].
        periods: number of samples of each phase, at least.
    """

    quantity: Quantity
    mean: Array
    outer: Array
    planned: Array
    spread: float
    periods: int


def measured_envelope(run: Run, quantity: Quantity, side: Side, from_time: float) -> Envelope:
    """The envelope of a measured quantity of a run, from `from_time` on, over the ticks at which a foot swings.

    Raises:
        InputError: the run is no walk, did not reach its end, or has too few steps.
    """
    scenario, log = run.scenario, run.log
    if scenario.system == "van_der_pol":
        raise InputError(f"run of '{scenario.name}': a bound is designed from a walk, not from an oscillator")
    check_straight(scenario)
    if not log.complete:
        raise InputError(f"run of '{scenario.name}': it {log.ending}, and a bound needs a walk that went on to its end")
    period = quantity.period(scenario.gait.ticks_per_step)
    ticks = np.rint(log.time / scenario.gait.tick).astype(int)
    walking = (log.element("gait_phase", "support") != 0) & (log.time >= from_time - 1e-9)
    samples, ahead = (
        [values[walking & (ticks % period == phase)] for phase in range(period)]
        for values in (measured(run, quantity), planned(run, quantity))
    )
    count = min(map(len, samples))
    if count < _FEWEST:
        what = "steps" if period == scenario.gait.ticks_per_step else "gaits"
        raise InputError(
            f"run of '{scenario.name}': at least {_FEWEST} {what} from {from_time:g} s on are needed, given {count}"
        )
    mean = np.array([sample.mean() for sample in samples])
    outer, farthest = (
        np.array([sample.max() if side == "upper" else sample.min() for sample in part]) for part in (samples, ahead)
    )
    return Envelope(quantity, mean, outer, farthest, float(np.abs(outer - mean).max()), count)


def design_bound(envelope: Envelope, margin: float, kind: Kind, side: Side) -> WalkBoundConfig:
    """The tightest bound of its kind that leaves the margin above (below) all measured values; see `bound_beyond`."""
    return bound_beyond((1.0 if side == "upper" else -1.0) * envelope.outer + margin, kind, side)


def robust_bound(envelope: Envelope, orbit: Array, margin: Array, kind: Kind, side: Side) -> WalkBoundConfig:
    """The tightest bound of its kind that leaves a margin beyond all that was measured or planned, and the orbit.

    There is room for as much again as the walk varies about its mean: where a plan may not go beyond what it catches
    up with, each error that slows the walk is kept.

    Args:
        orbit, margin: over one period, (period,) [unit of the quantity].
    """
    sign = 1.0 if side == "upper" else -1.0
    walked = np.max(sign * np.array([envelope.outer, envelope.planned, orbit]), axis=0)
    return bound_beyond(walked + envelope.spread + margin, kind, side)


def bound_beyond(wanted: Array, kind: Kind, side: Side) -> WalkBoundConfig:
    """The tightest bound of its kind that is at least as far out as wanted, (period,); for a lower one both negative.

    A table follows the envelope tick by tick. A harmonic is mean + cosine cos(2πk/N) + sine sin(2πk/N) with the least
    mean distance from the envelope, the solution of a linear program.
    """
    sign = 1.0 if side == "upper" else -1.0
    if kind == "tabulated":
        return WalkBoundConfig(kind="tabulated", values=tuple((sign * _up(wanted)).tolist()))
    angle = 2.0 * np.pi * np.arange(len(wanted)) / len(wanted)
    shapes = np.column_stack([np.ones(len(wanted)), np.cos(angle), np.sin(angle)])
    found = linprog(shapes.mean(axis=0), A_ub=-shapes, b_ub=-wanted, bounds=[(None, None)] * 3, method="highs")
    mean, cosine, sine = np.round(found.x * _DIGITS) / _DIGITS
    mean = round(float(mean + _up(np.max(wanted - shapes @ [mean, cosine, sine]))), 5)
    return WalkBoundConfig(kind="harmonic", mean=sign * mean, cosine=sign * float(cosine), sine=sign * float(sine))


def _up(values: Array | np.floating) -> Array:
    """The values rounded up to a multiple of 1/_DIGITS."""
    return np.asarray(np.round(np.ceil(np.asarray(values) * _DIGITS - 1e-6) / _DIGITS, 5))
