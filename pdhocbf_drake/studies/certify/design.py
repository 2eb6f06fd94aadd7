"""A periodic bound V̄(k) designed from a recorded walk: its variability at each phase, and a margin above it."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from scipy.optimize import linprog

from pdhocbf_drake.barriers.config import BarrierConfig, BoundConfig, Side
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.sets.polytope import Array
from pdhocbf_drake.simulation.run_folder import Run

Kind = Literal["tabulated", "harmonic"]

_DIGITS = 1e5  # bounds are rounded outwards to 10 µm/s
_FEWEST = 3  # records of a phase, below which they show no variability


class Envelope(NamedTuple):
    """The CoM velocity of a walk at each phase.

    Attributes:
        mean: shape (period,) [m/s].
        outer: the largest velocity for an upper bound, the smallest for a lower one, shape (period,) [m/s].
        spread: the largest distance of outer from mean [m/s].
        periods: the least number of records of a phase.
    """

    mean: Array
    outer: Array
    spread: float
    periods: int


def measured_envelope(run: Run, axis: Literal["x", "y"], side: Side, from_time: float) -> Envelope:
    """Reads the measured velocity of a run, from `from_time` on and while it walks.

    Forward velocity repeats every step, lateral velocity every two.

    Raises:
        InputError: the run is no walk, did not reach its end, or has too few steps.
    """
    scenario, log = run.scenario, run.log
    if scenario.system == "van_der_pol":
        raise InputError(f"run of '{scenario.name}': a bound is designed from a walk, not from an oscillator")
    if not log.complete:
        raise InputError(f"run of '{scenario.name}': it {log.ending}, and a bound needs a walk that went on to its end")
    n = scenario.gait.ticks_per_step
    period = n if axis == "x" else 2 * n
    ticks = np.rint(log.time / scenario.gait.tick).astype(int)
    walking = (log.element("gait_phase", "support") != 0) & (log.time >= from_time - 1e-9)
    velocity = log.element("lip_state", f"v{axis}")
    samples = [velocity[walking & (ticks % period == phase)] for phase in range(period)]
    count = min(len(values) for values in samples)
    if count < _FEWEST:
        what = "steps" if axis == "x" else "gaits"
        raise InputError(
            f"run of '{scenario.name}': at least {_FEWEST} {what} from {from_time:g} s on are needed, given {count}"
        )
    mean = np.array([values.mean() for values in samples])
    outer = np.array([values.max() if side == "upper" else values.min() for values in samples])
    return Envelope(mean, outer, float(np.abs(outer - mean).max()), count)


def design_bound(envelope: Envelope, margin: float, kind: Kind, side: Side) -> BoundConfig:
    """The tightest bound of its kind that leaves the margin above (below) everything that was measured.

    A table follows the envelope tick by tick. A harmonic is mean + cosine cos(2πk/N) + sine sin(2πk/N) with the least
    mean distance from it, a linear program.

    Raises:
        InputError: the margin is not a number from 0 on.
    """
    if not 0.0 <= margin < np.inf:
        raise InputError(f"--margin must be 0 or more [m/s], given {margin}")
    sign = 1.0 if side == "upper" else -1.0
    wanted = sign * envelope.outer + margin
    if kind == "tabulated":
        return BoundConfig(kind="tabulated", values=tuple((sign * _up(wanted)).tolist()))
    angle = 2.0 * np.pi * np.arange(len(wanted)) / len(wanted)
    shapes = np.column_stack([np.ones(len(wanted)), np.cos(angle), np.sin(angle)])
    found = linprog(shapes.mean(axis=0), A_ub=-shapes, b_ub=-wanted, bounds=[(None, None)] * 3, method="highs")
    mean, cosine, sine = np.round(found.x * _DIGITS) / _DIGITS
    mean += float(_up(np.max(wanted - shapes @ [mean, cosine, sine])))
    mean = round(float(mean), 5)
    return BoundConfig(kind="harmonic", mean=sign * mean, cosine=sign * float(cosine), sine=sign * float(sine))


def designed_barrier(
    run: Run, axis: Literal["x", "y"], side: Side, kind: Kind, margin: float, gamma: tuple[float, ...], from_time: float
) -> tuple[BarrierConfig, Envelope]:
    """A barrier with a designed bound, and the envelope that it is designed from; raises `InputError`."""
    envelope = measured_envelope(run, axis, side, from_time)
    return BarrierConfig(axis=axis, side=side, bound=design_bound(envelope, margin, kind, side), gamma=gamma), envelope


def _up(values: Array | np.floating) -> Array:
    """Rounded upwards to 10 µm/s."""
    return np.asarray(np.round(np.ceil(np.asarray(values) * _DIGITS - 1e-6) / _DIGITS, 5))
