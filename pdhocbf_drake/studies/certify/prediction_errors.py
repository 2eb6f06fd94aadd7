"""What a recorded walk shows of the controller's prediction errors, and the margin of a bound that belongs to them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.stats import t as student

from pdhocbf_drake.barriers import AffineBarrier
from pdhocbf_drake.barriers.uncertainty import Uncertainty, tightening
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.sets.polytope import Array
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.walking.vhip import Vhip

_FEWEST = 5  # errors of a phase from which a spread can be read
_DIGITS = 1e6  # half-widths are rounded outwards to 1e-6 m and 1e-6 m/s


class PredictionErrors(NamedTuple):
    """The box W of the prediction errors of CoM and velocity along x and y.

    Attributes:
        half_widths: Δc, Δv [m, m/s].
        phase: at which the largest Δv was found [ticks].
        samples: errors of each phase, at least.
        largest: the largest measured |error| of CoM and velocity [m, m/s].
    """

    half_widths: tuple[float, float]
    phase: int
    samples: int
    largest: tuple[float, float]


def prediction_errors(run: Run, confidence: float, from_time: float) -> PredictionErrors:
    """W from a walk: the error is the measured [c, v](k) less the one that was planned for tick k at k − 1.

    Of the n errors of each phase of the step, axis and state with mean m and standard deviation s, the next one stays
    within m ± t s √(1 + 1/n) with the given confidence, t the quantile of Student's distribution, if they are normal.
    W is the box around 0 that holds these intervals of all phases and of both axes.

    Raises:
        InputError: the confidence is not between 0 and 1; or the walk is too short.
    """
    if not 0.0 < confidence < 1.0:
        raise InputError(f"--confidence must be above 0 and below 1, given {confidence:g}")
    gait, log = run.scenario.gait, run.log
    ticks = np.rint(log.time / gait.tick).astype(int)
    walking = (log.element("gait_phase", "support") != 0) & (log.time >= from_time - 1e-9)
    sides, largest, counts = np.zeros((gait.ticks_per_step, 2)), np.zeros(2), []
    for state, names in enumerate((("x", "y"), ("vx", "vy"))):
        for name in names:
            error = log.element("lip_state", name) - log.element("com_reference", name)
            for phase in range(gait.ticks_per_step):
                sample = error[walking & (ticks % gait.ticks_per_step == phase)]
                counts.append(len(sample))
                if len(sample) < _FEWEST:
                    raise InputError(
                        f"run of '{run.scenario.name}': prediction errors need at least {_FEWEST} steps from "
                        f"{from_time:g} s on, given {len(sample)}"
                    )
                spread = float(student.ppf(0.5 + confidence / 2.0, len(sample) - 1)) * sample.std(ddof=1)
                side = abs(sample.mean()) + spread * np.sqrt(1.0 + 1.0 / len(sample))
                sides[phase, state] = max(sides[phase, state], side)
                largest[state] = max(largest[state], np.abs(sample).max())
    com, velocity = (np.ceil(sides.max(axis=0) * _DIGITS) / _DIGITS).tolist()
    return PredictionErrors((com, velocity), int(sides[:, 1].argmax()), min(counts), (largest[0], largest[1]))


def margin_for(barrier: AffineBarrier, vhip: Vhip, errors: PredictionErrors, period: int) -> Array:
    """t(k) of (R4) in docs/robust.md for W over one period of the bound, (period,) [unit of h].

    A bound this far from the undisturbed walk leaves that walk to a controller with `mpc.robust` for the same W.
    """
    known = Uncertainty(np.array([*errors.half_widths, 0.0]), np.zeros(3))
    nearer = tightening(barrier, vhip.system, known).bound
    return np.asarray(np.max([nearer[start : start + period] for start in range(0, len(nearer), period)], axis=0))
