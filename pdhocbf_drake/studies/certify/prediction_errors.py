"""What a recorded walk shows of the controller's prediction errors, for each tick of a step and each axis."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.stats import t as student

from pdhocbf_drake.analysis.heading import along_heading
from pdhocbf_drake.analysis.late import lagging
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.config import AxisBoxes, Box, RobustConfig
from pdhocbf_drake.robot import SIDES
from pdhocbf_drake.sets.polytope import Array
from pdhocbf_drake.simulation.commands import commanded_gait
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.sensed import sensed
from pdhocbf_drake.systems.signals import places

_FEWEST = 5  # errors of a phase from which a spread can be read
_DIGITS = 1e6  # half-widths are rounded outwards to 1e-6 m and 1e-6 m/s
_ROUNDING = 1e-9  # [m] and [m/s]: a smaller error is none
_AXES = ((0, 3), (1, 4))  # c and v of x and y in lip_state


class PredictionErrors(NamedTuple):
    """How far predictions and measurements were off.

    Attributes:
        boxes: Δc, Δv along x and y of every tick of a step: by how much the state that was measured after it differs
            from the prediction of it, (2, N, 2) [m, m/s].
        estimate: by how much the true state differs from what was measured, along either axis [m, m/s].
        samples: errors of each tick of a step, at least.
        largest: the largest |error| of a prediction, of CoM and velocity [m, m/s].
    """

    boxes: Array
    estimate: Box
    samples: int
    largest: Box

    @property
    def robust(self) -> RobustConfig:
        """The `mpc.robust` that withstands these errors."""
        x, y = (tuple((float(com), float(velocity)) for com, velocity in part) for part in self.boxes)
        pattern = AxisBoxes(x=x, y=y)
        return RobustConfig(disturbance=pattern, estimate=self.estimate, sigmas=1.0, innovations=any(self.estimate))

    @property
    def widest(self) -> Box:
        """Δc and Δv of the worst tick and axis [m, m/s]."""
        com, velocity = self.boxes.max(axis=(0, 1))
        return float(com), float(velocity)


def prediction_errors(run: Run, confidence: float, from_time: float) -> PredictionErrors:
    """Errors of a walk that the next ones stay within with a confidence, at each tick of a step, if they are normal.

    Of n errors with mean m and standard deviation s the next one stays within m ± t s √(1 + 1/n), t the quantile of
    Student's distribution. A box around 0 holds these intervals.

    Raises:
        InputError: the walk is too short.
    """
    gait, log = run.scenario.gait, run.log
    ticks = np.rint(log.time / gait.tick).astype(int)
    measured, zmp = measured_states(run, ticks)
    off, missed = _innovations(run, ticks, measured, zmp), _estimate_errors(run, measured)
    walking = (log.element("gait_phase", "support") != 0) & (log.time >= from_time - 1e-9)
    walking &= np.isfinite(off).all(axis=(1, 2))
    rows = [np.flatnonzero(walking & (ticks % gait.ticks_per_step == phase)) for phase in range(gait.ticks_per_step)]
    count = min(map(len, rows))
    if count < _FEWEST:
        raise InputError(
            f"run of '{run.scenario.name}': prediction errors need at least {_FEWEST} steps from {from_time:g} s on, "
            f"given {count}"
        )
    boxes = np.array([_half_widths(off[part], confidence) for part in rows]).swapaxes(0, 1)
    com, velocity = np.max([_half_widths(missed[part], confidence) for part in rows], axis=(0, 1)).tolist()
    largest = np.abs(off[walking]).max(axis=(0, 1)).tolist()
    return PredictionErrors(boxes, (com, velocity), count, (largest[0], largest[1]))


def measured_states(run: Run, ticks: Array) -> tuple[Array, Array]:
    """[c, v](k) of both axes, as the controller knew it d ticks later, and the ZMP p(k) that was planned.

    It planned com_reference(k + 1) = A_k x̂(k) + B_k p(k) from what it believed, x̂(k), which is the measured state of
    k − d, filtered and carried forward with the same equations. Both are undone.

    Returns:
        (T, 2 axes, 2), NaN in the last d + 1 rows, and (T, 2) [m, m/s]; along the heading and across it.
    """
    log, config, tick = run.log, sensed(run.scenario), run.scenario.gait.tick
    pull = _pull(run, ticks)
    zmp = along_heading(log, "zmp_reference", 0, 2)
    if "input_disturbance" in log:  # what cancels it is no part of the plan
        zmp = zmp - along_heading(log, "input_disturbance", 2, 3) * tick / pull
    if config.zmp_lag is not None:
        zmp = lagging(zmp, config.zmp_lag * tick)
    com, velocity = (along_heading(log, "com_reference", *pair) for pair in _AXES)
    for _ in range(config.delay_ticks + 1):
        com, velocity = (np.vstack([part[1:], np.full((1, 2), np.nan)]) for part in (com, velocity))
        velocity = (velocity - pull * (com - zmp)) / (1.0 - tick * pull)
        com = com - tick * velocity
    return np.stack([com, velocity], axis=2), zmp


def _pull(run: Run, ticks: Array) -> Array:
    """δ eta(k), (T, 1) [1/s]."""
    eta = commanded_gait(run.scenario).height.eta()
    return np.asarray((run.scenario.gait.tick * eta)[ticks % len(eta)][:, None])


def _innovations(run: Run, ticks: Array, measured: Array, zmp: Array) -> Array:
    """By how much the states of k + 1 differ from what the template makes of those of k, (T, 2 axes, 2)."""
    com, velocity = measured[:, :, 0], measured[:, :, 1]
    moved = com + run.scenario.gait.tick * velocity
    predicted = np.stack([moved, velocity + _pull(run, ticks) * (com - zmp)], axis=2)
    return np.concatenate([measured[1:] - predicted[:-1], np.full((1, 2, 2), np.nan)])


def _estimate_errors(run: Run, measured: Array) -> Array:
    """True less measured states, the CoM from the stance foot, which is where it was put, (T, 2 axes, 2)."""
    log = run.log
    true = np.stack([along_heading(log, "lip_state", *pair) for pair in _AXES], axis=2)
    if "foot_state" in log and run.scenario.measurement.source == "sensors":
        left = (log.element("gait_phase", "support") > 0)[:, None]
        feet = [along_heading(log, "foot_state", *places("foot_state", f"{side}_x", f"{side}_y")) for side in SIDES]
        true[:, :, 0] -= np.where(left, *feet) - along_heading(log, "stance_plan", 2, 3)
    return np.asarray(true - measured)


def _half_widths(errors: Array, confidence: float) -> Array:
    """Of errors (n, 2 axes, 2), (2, 2)."""
    n = len(errors)
    spread = float(student.ppf(0.5 + confidence / 2.0, n - 1)) * errors.std(axis=0, ddof=1) * np.sqrt(1.0 + 1.0 / n)
    sides = np.abs(errors.mean(axis=0)) + spread
    return np.asarray(np.where(sides < _ROUNDING, 0.0, np.ceil(sides * _DIGITS) / _DIGITS))
