"""What a barrier buys on the template: kicks, sustained pushes and wrong speed commands, for a range of γ."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.simulation.build import Walk, build_walk
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.push.measures import ACTS, Array, Measures, first_time, in_every_case, recovery_time
from pdhocbf_drake.studies.push.variants import NONE, PERIODIC, variant, with_gamma
from pdhocbf_drake.studies.reproduce.events import commanded
from pdhocbf_drake.studies.reproduce.template_walk import TemplateRecord, run_template, standing

_GAITS = 15  # after which the walk from a stand repeats to a thousandth of a margin
_WATCHED = 160  # [ticks]


class TemplateWorth:
    """The events of one scenario's template, under any barrier.

    Args:
        scenario: what walks; its barriers say which velocity is bounded, and with which margin.
        kick: velocity gained at once [m/s]. push: acceleration for one step [m/s²].
        command: commanded stride over the one that the bound was made for [1].
        phases: ticks of the step at which events begin.
    """

    def __init__(self, scenario: Scenario, kick: float, push: float, command: float, phases: Sequence[int]) -> None:
        self._scenario, self._phases, self._command = scenario, tuple(phases), command
        period, tick = scenario.gait.ticks_per_step, scenario.gait.tick
        self._gains = {
            f"kick {1e3 * kick:g} mm/s": np.array([kick]),
            f"push {push:g} m/s², {period * tick:g} s": np.full(period, push * tick),
        }
        self._free = build_walk(variant(scenario, NONE))
        self._first = scenario.gait.ticks_per_gait * _GAITS
        self._settled = self._settle(self._free)
        self._nominal = self._starts(self._free, self._settled)[1]
        self._margin = periodic_margin(variant(scenario, PERIODIC))

    def run(self, gammas: Sequence[float], tell: Callable[[str], None] = lambda words: None) -> list[Measures]:
        """Every event without a barrier, then under both kinds of barrier for each γ."""
        return in_every_case(self._under, gammas, tell)

    def _settle(self, walk: Walk) -> Memory:
        return run_template(walk, standing(walk), 0, self._first)[1]

    def _starts(self, walk: Walk, memory: Memory) -> tuple[dict[int, Memory], Array]:
        """The memory at each phase of a step, and the velocity over that step (N,)."""
        starts, speed = {}, []
        for phase in range(walk.gait.period):
            if phase in self._phases:
                starts[phase] = memory
            record, memory = run_template(walk, memory, self._first + phase, 1)
            speed.append(record.speed[0])
        return starts, np.array(speed)

    def _under(self, barrier: str, gamma: float) -> list[Measures]:
        plain = variant(self._scenario, barrier)
        walk = self._free if barrier == NONE else build_walk(with_gamma(plain, gamma))
        without = None if barrier == NONE else self._free.mpc
        memory = self._settle(walk)
        # A barrier changes the plans of the undisturbed walk too, and that is no answer to an event.
        still, _ = run_template(walk, memory, self._first, self._scenario.gait.ticks_per_gait, None, without)
        acts = float(still.action.max()) + ACTS
        rows = []
        for phase, start in self._starts(walk, memory)[0].items():
            for event, gains in self._gains.items():
                record, _ = run_template(walk, start, self._first + phase, _WATCHED, gains, without)
                rows.append(self._measured(walk, record, (barrier, gamma, event, phase), acts))
        stride, step = self._scenario.gait.stride * self._command, self._first // walk.gait.period
        other = commanded(walk, stride, step)
        free = None if without is None else commanded(self._free, stride, step).mpc
        record, _ = run_template(other, memory, self._first, 2 * _WATCHED, None, free)
        event = f"command {stride:g} m for {self._scenario.gait.stride:g} m"
        return [*rows, self._measured(walk, record, (barrier, gamma, event, 0), acts)]

    def _measured(
        self, walk: Walk, record: TemplateRecord, which: tuple[str, float, str, int], acts: float
    ) -> Measures:
        tick, period = self._scenario.gait.tick, walk.gait.period
        ticks = record.first + np.arange(len(record.speed))
        above = record.speed - self._nominal[ticks % period]
        bound = np.array([walk.barriers[0].bound(int(k)) for k in ticks]) if walk.barriers else np.inf
        recovers = recovery_time(above, self._margin, tick)
        com, velocity, zmp = record.states[:, 0].T
        work = np.maximum(walk.vhip.eta[ticks % period] * (com - zmp) * velocity, 0.0).sum() * tick
        return Measures(
            "template", *which, first_time(bound - record.speed < 0.0, tick), first_time(record.action > acts, tick),
            float(above.max()), recovers, math.ceil(recovers / (period * tick)) if recovers == recovers else math.nan,
            float(work), not bool(record.unplanned.any()),
        )  # fmt: skip


def periodic_margin(scenario: Scenario) -> float:
    """The periodic bound's margin over the orbit [m/s]."""
    margins = [config.bound.margin for config in scenario.barriers.values() if config.bound.margin is not None]
    return margins[0] if margins else 0.01
