"""Unsafe events on the template: the same event under Case 1, Case 2 and no barrier, from the same settled walk.

What is measured, for each barrier:

- it *notices* at the first tick at which its own h < 0 on the measured state;
- it *acts* at the first tick at which the controller's ZMP velocity differs by more than 10 mm/s from what the same
  program without the barrier would do from the same state;
- the walk has *recovered* once the velocity stays within the periodic margin of the nominal one, from above.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.simulation.build import Walk
from pdhocbf_drake.studies.reproduce.calibration import PAPER_PERIODIC
from pdhocbf_drake.studies.reproduce.runs import Request, Runs
from pdhocbf_drake.studies.reproduce.template_walk import TemplateRecord, run_template, standing
from pdhocbf_drake.walking import GaitConfig

SETTLED = 1200  # tick from which the walk repeats, a multiple of a gait
_GAMMA = "barriers: {forward_speed: {gamma: [0.5, 0.5]}}"
CASES: dict[str, Request] = {
    "constant": ("paper_vhip_dcbf", _GAMMA),
    "periodic": ("paper_vhip", _GAMMA),
    "free": ("paper_vhip", "barriers: {forward_speed: null}"),
}
_ACTS = 1e-2  # [m/s] of ZMP velocity; the undisturbed walk stays below a third of this


@dataclass(frozen=True)
class Outcome:
    """One event under one case; ticks are counted from the event, NaN for never.

    Attributes:
        record: the walk, from the event on.
        bound: V̄ along it, (T,) [m/s]; NaN without a barrier.
        notices, acts: first ticks.
        recovers: ticks until the velocity stays within the periodic margin above the nominal one.
        peak: largest velocity above the nominal one, after the event [m/s].
        slack: largest slack paid [m/s].
        planned: whether every tick had a plan.
    """

    record: TemplateRecord
    bound: NDArray[np.float64]
    notices: float
    acts: float
    recovers: float
    peak: float
    slack: float
    planned: bool


class Laboratory:
    """The three walks, settled, with the memory at every tick of one gait, to begin events from."""

    def __init__(self, runs: Runs) -> None:
        self.walks: dict[str, Walk] = {case: runs.walk(*request) for case, request in CASES.items()}
        self.free: PeriodicMpc = self.walks["free"].mpc
        self.gait: GaitConfig = self.walks["free"].gait.config
        self.period = self.gait.ticks_per_step
        self._starts: dict[str, list[Memory]] = {}
        for case, walk in self.walks.items():
            memory = run_template(walk, standing(walk), 0, SETTLED)[1]
            self._starts[case] = [memory]
            for tick in range(SETTLED, SETTLED + 2 * self.period):
                memory = run_template(walk, memory, tick, 1)[1]
                self._starts[case].append(memory)
        record, _ = run_template(self.walks["free"], self._starts["free"][0], SETTLED, self.period)
        self.nominal = record.speed  # over one step, (N,) [m/s]

    def start(self, case: str, phase: int) -> Memory:
        """The settled walk's memory at a phase of the gait."""
        return self._starts[case][phase]

    def run(self, case: str, phase: int, gains: NDArray[np.float64], ticks: int) -> Outcome:
        """The event `gains` (velocity added before each tick [m/s]) from a phase of the gait on."""
        walk = self.walks[case]
        without = self.free if case != "free" else None
        record, _ = run_template(walk, self._starts[case][phase], SETTLED + phase, ticks, gains, without)
        return self.judged(walk, record)

    def judged(self, walk: Walk, record: TemplateRecord) -> Outcome:
        """Notices, acts, recovers."""
        ticks = record.first + np.arange(len(record.speed))
        bound = np.full(len(ticks), np.nan)
        if walk.barriers:
            bound = np.array([walk.barriers[0].bound(int(k)) for k in ticks])
        above = record.speed - self.nominal[ticks % self.period]
        # A hundredth of a margin: the settled walk itself repeats to that.
        late = np.flatnonzero(above > 1.01 * PAPER_PERIODIC)
        return Outcome(
            record,
            bound,
            first_tick(bound - record.speed < 0),
            first_tick(record.action > _ACTS),
            float(late[-1] + 1) if len(late) else 0.0,
            float(above.max()),
            float(record.slack.max()),
            not record.unplanned.any(),
        )


def commanded(walk: Walk, stride: float, step: int) -> Walk:
    """The same walk and bounds, told to take steps of another length from `step` on: a wrong speed command."""
    gait = walk.gait.with_stride(stride, step)
    mpc = PeriodicMpc(gait, walk.vhip, walk.mpc.config, walk.mpc.barriers)
    return Walk(gait, walk.vhip, mpc, walk.axes, walk.barriers)


def first_tick(mask: NDArray[np.bool_]) -> float:
    """Index of the first True, NaN where there is none."""
    return float(np.argmax(mask)) if mask.any() else np.nan


def kicks(laboratory: Laboratory, size: float, ticks: int) -> Mapping[str, list[Outcome]]:
    """An instantaneous gain of velocity `size` [m/s] at each phase of a step, followed for some ticks."""
    gain = np.array([size])
    return {case: [laboratory.run(case, phase, gain, ticks) for phase in range(laboratory.period)] for case in CASES}
