"""What a barrier buys on the robot: a kick and a sustained push at some phases, and a wrong speed command."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.push.measures import ACTS, Array, Measures, first_time, in_every_case, recovery_time
from pdhocbf_drake.studies.push.rig import PushRig, Trial
from pdhocbf_drake.studies.push.variants import NONE, PERIODIC, variant, with_gamma
from pdhocbf_drake.studies.worth.template import periodic_margin
from pdhocbf_drake.walking.barrier_config import WalkBarrierConfig

_WATCHED = 2.4  # [s]


class RobotWorth:
    """The events of one scenario's robot, under any barrier.

    Args:
        scenario: what walks; its barriers say which velocity is bounded, and with which margin.
        kick: impulse of a push of 0.1 s [N s]. push: force for one step [N].
        command: commanded stride over the one that the bound was made for [1].
        phases: ticks of the gait at which events begin.
    """

    def __init__(self, scenario: Scenario, kick: float, push: float, command: float, phases: Sequence[int]) -> None:
        self._scenario, self._command = scenario, command
        self._phases = tuple(phases)
        gait = scenario.gait
        self._step = gait.ticks_per_step * gait.tick
        self._forces = {
            f"kick {kick:g} N s": (kick / 0.1, 0.1),
            f"push {push:g} N, {self._step:g} s": (push, self._step),
        }
        self._margin = periodic_margin(variant(scenario, PERIODIC))
        self._nominal: Array = np.zeros(gait.ticks_per_gait)
        self._still: Array = np.zeros(0)
        self._inputs: dict[tuple[str, int], Array] = {}

    def run(self, gammas: Sequence[float], tell: Callable[[str], None] = lambda words: None) -> list[Measures]:
        """Every event without a barrier, then under both kinds of barrier for each γ."""
        return in_every_case(self._under, gammas, tell)

    def _under(self, barrier: str, gamma: float) -> list[Measures]:
        scenario = variant(self._scenario, barrier)
        if barrier != NONE:
            scenario = with_gamma(scenario, gamma)
        rig = PushRig(scenario, self._phases)
        still = rig.trial(self._phases[0], np.zeros(3), 0.1, 2.2 * self._step).log
        inputs = still.element("zmp_reference", "ux")
        if barrier == NONE:
            at = np.round(still.time / scenario.gait.tick).astype(int) % len(self._nominal)
            self._nominal[at] = still.element("lip_state", "vx")
            self._still = inputs
        # A barrier changes the plans of the undisturbed walk too, and that is no answer to an event.
        acts = float(_apart(inputs, self._still).max()) + ACTS
        rows = []
        for phase in self._phases:
            for event, (force, duration) in self._forces.items():
                trial = rig.trial(phase, np.array([force, 0.0, 0.0]), duration, _WATCHED)
                rows.append(self._measured(trial, (barrier, gamma, event, phase), acts))
        stride = scenario.gait.stride
        faster = PushRig(_commanded(scenario, self._command), self._phases[:1])
        trial = faster.trial(self._phases[0], np.zeros(3), 0.1, _WATCHED)
        event = f"command {stride * self._command:g} m for {stride:g} m"
        return [*rows, self._measured(trial, (barrier, gamma, event, self._phases[0]), acts)]

    def _measured(self, trial: Trial, which: tuple[str, float, str, int], acts: float) -> Measures:
        log, tick = trial.log, self._scenario.gait.tick
        barrier, _, event, phase = which
        speed = log.element("lip_state", "vx")
        above = speed - self._nominal[np.round(log.time / tick).astype(int) % len(self._nominal)]
        inputs = log.element("zmp_reference", "ux")
        if barrier == NONE:
            self._inputs[event, phase] = inputs
        action = _apart(inputs, self._inputs[event, phase])
        noticed = log["h"].min(axis=1) < 0.0 if "h" in log else np.zeros(len(log), dtype=bool)
        recovers = recovery_time(above, self._margin, tick) if trial.survived else math.nan
        return Measures(
            "robot", *which, first_time(noticed, tick), first_time(action > acts, tick),
            float(above.max()), recovers, math.ceil(recovers / self._step) if recovers == recovers else math.nan,
            _work(log, tick), trial.survived,
        )  # fmt: skip


def _apart(inputs: Array, others: Array) -> Array:
    """Size of the difference for as long as both walk."""
    both = min(len(inputs), len(others))
    return np.abs(inputs[:both] - others[:both])


def _work(log: RunLog, tick: float) -> float:
    """Positive mechanical work of the twelve joints [J]."""
    return float(np.maximum(log["actuation"] * log["joint_state"][:, 12:], 0.0).sum() * tick)


def _commanded(scenario: Scenario, factor: float) -> Scenario:
    """Longer steps are commanded, and the bounds stay those of the right ones."""
    stride = scenario.gait.stride
    kept = {name: _with_stride(config, stride) for name, config in scenario.barriers.items()}
    gait = scenario.gait.model_copy(update={"stride": stride * factor})
    return scenario.model_copy(update={"gait": gait, "barriers": kept})


def _with_stride(config: WalkBarrierConfig, stride: float) -> WalkBarrierConfig:
    if not config.bound.follows_orbit or config.bound.stride is not None:
        return config
    return config.model_copy(update={"bound": config.bound.model_copy(update={"stride": stride})})
