"""Fig. 7 as an experiment on the template: kicks at every phase, a sustained push, a wrong speed command."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.drawing import label, legend, panels
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.reproduce.calibration import PAPER_PERIODIC
from pdhocbf_drake.studies.reproduce.report import LABELS, STYLES, Number, Picture, Section
from pdhocbf_drake.studies.reproduce.runs import Request, Runs
from pdhocbf_drake.studies.reproduce.unsafe_findings import (
    BARRIERS,
    bound,
    command_table,
    conclusions,
    count,
    finding,
    kick_table,
    push_table,
    speed,
)
from pdhocbf_drake.studies.shared.cases import CASES, DCBF, NONE, PERIODIC
from pdhocbf_drake.studies.shared.measures import ACTS, Array, Outcome, SafeOrbit
from pdhocbf_drake.studies.shared.template import SettledWalk

_GAMMA = "barriers: {forward_speed: {gamma: [0.5, 0.5]}}"
REQUESTS: dict[str, Request] = {
    NONE: ("paper_vhip", "barriers: {forward_speed: null}"),
    DCBF: ("paper_vhip_dcbf", _GAMMA),
    PERIODIC: ("paper_vhip", _GAMMA),
}
KICKS = (0.01, 0.02, 0.03, 0.05)  # [m/s]
SHOWN_KICK, SHOWN_PHASE = 0.02, 15  # where the constant bound is far away
PUSHES = (0.05, 0.1, 0.2, 0.4)  # [m/s²], for one step
COMMANDS = (0.152, 0.155, 0.16, 0.17, 0.18)  # [m] a step, where 0.15 m is right
_TICKS, _COMMANDED_TICKS = 120, 200
_SHOWN_COMMAND, _SHOWN_PUSH = 0.16, 0.2
_MARKERS = {"acts": ("^", 13, "first acts"), "notices": ("X", 8, "first h < 0")}  # the larger shows behind the other
_COMMAND = "pdhocbf reproduce --only fig7"


class Laboratory:
    """The three settled walks, from which the same event begins in each case.

    Attributes:
        walks: by case.
        nominal: forward velocity of the undisturbed walk without barriers over one step, (N,) [m/s].
    """

    def __init__(self, runs: Runs) -> None:
        free = runs.walk(*REQUESTS[NONE]).mpc
        self.walks = {
            case: SettledWalk(runs.walk(*request), None if case == NONE else free) for case, request in REQUESTS.items()
        }
        self.gait = free.gait.config
        undisturbed = self.walks[NONE].undisturbed
        self._orbit = SafeOrbit(load_scenario(*REQUESTS[PERIODIC]), undisturbed)
        self.nominal: Array = undisturbed.states[: self.gait.ticks_per_step, 0, 1]

    def outcome(self, case: str, phase: int, gains: Array, ticks: int) -> Outcome:
        """What the event `gains` (forward velocity added before each tick [m/s]) at a phase of the gait does."""
        walk = self.walks[case]
        kicks = np.column_stack([gains, np.zeros(len(gains))])
        return self._orbit.outcome(walk.after(phase, kicks, ticks), walk.undisturbed)

    def kicked(self, size: float, ticks: int) -> dict[str, list[Outcome]]:
        """What a sudden gain of velocity [m/s] at each phase of a step does, by case."""
        gain, phases = np.array([size]), range(self.gait.ticks_per_step)
        return {case: [self.outcome(case, phase, gain, ticks) for phase in phases] for case in CASES}

    def commanded(self, case: str, stride: float, ticks: int) -> Outcome:
        """What a wrong speed command does: steps of another length [m] from the second one on."""
        walk = self.walks[case]
        other = walk.commanded(stride, walk.first // self.gait.ticks_per_step + 1)
        return self._orbit.outcome(other.after(0, np.zeros((0, 2)), ticks), walk.undisturbed)


def figure_7(runs: Runs) -> Section:
    """What each barrier notices, when it acts, and what that changes."""
    laboratory = Laboratory(runs)
    period, tick, stride = laboratory.gait.ticks_per_step, laboratory.gait.tick, laboratory.gait.stride
    step = f"{period * tick:g} s"
    by_size: dict[float, dict[str, list[Outcome]]] = {}
    for size in KICKS:
        runs.report(f"velocity kicks of {1e3 * size:g} mm/s at {period} phases, three cases")
        by_size[size] = laboratory.kicked(size, _TICKS)
    runs.report("sustained pushes and wrong speed commands")
    pushes = {a: {c: laboratory.outcome(c, 0, np.full(period, a * tick), _TICKS) for c in CASES} for a in PUSHES}
    orders = {length: {c: laboratory.commanded(c, length, _COMMANDED_TICKS) for c in CASES} for length in COMMANDS}
    shown = {case: by_size[SHOWN_KICK][case][SHOWN_PHASE] for case in CASES}
    wrong = f"steps of {_SHOWN_COMMAND:g} m commanded instead of {stride:g} m"
    events = [
        ("fig7_kick", f"a kick of {1e3 * SHOWN_KICK:g} mm/s at phase {SHOWN_PHASE} of {period}", shown, 60),
        ("fig7_push", f"a push of {_SHOWN_PUSH:g} m/s² for {step}", pushes[_SHOWN_PUSH], 100),
        ("fig7_command", wrong, orders[_SHOWN_COMMAND], 200),
    ]
    pictures = [_trajectories(laboratory, *event) for event in events]
    pictures.append(_phases(by_size))
    noticed = {case: [count(o.notices == 0 for o in by_size[s][case]) for s in KICKS] for case in BARRIERS}
    return Section(
        "Fig. 7: unsafe events, as an experiment",
        [_definitions(), *conclusions(by_size, orders, laboratory.nominal)],
        pictures,
        [kick_table(by_size), push_table(pushes, step), command_table(orders, stride)],
        [
            Number(
                f"kick of {1e3 * size:g} mm/s: phases of {period} at which {LABELS[case]} sees h < 0 at once",
                None,
                noticed[case][i],
                "phases",
                None,
                False,
                _COMMAND,
            )
            for i, size in enumerate(KICKS)
            for case in BARRIERS
        ],
        finding(by_size, pushes, orders),
    )


def _trajectories(
    laboratory: Laboratory, name: str, event: str, outcomes: Mapping[str, Outcome], ticks: int
) -> Picture:
    figure, (axes,) = panels(1, height=3.6)
    time = laboratory.gait.tick * np.arange(ticks)
    phases = (outcomes[NONE].record.first + np.arange(ticks)) % laboratory.gait.ticks_per_step
    nominal = laboratory.nominal[phases]
    low = min(float(speed(o)[:ticks].min()) for o in outcomes.values())
    floor = min(low, float(nominal.min())) - 0.01
    for case in BARRIERS:
        zone: dict[str, Any] = (
            {"hatch": "//", "fc": "none", "ec": palette.CASES[PERIODIC], "alpha": 0.5}
            if case == PERIODIC
            else {"fc": palette.CASES[DCBF], "alpha": 0.18}
        )
        axes.fill_between(time, floor, bound(outcomes[case])[:ticks], lw=0, label=f"safe zone, {LABELS[case]}", **zone)
    axes.plot(time, nominal, color=palette.MEASURED_COM, lw=1.0, label="nominal")
    data = {"time [s]": time, "nominal [m/s]": nominal}
    for case, outcome in outcomes.items():
        velocity = speed(outcome)[:ticks]
        axes.plot(time, velocity, color=palette.CASES[case], ls=STYLES[case], lw=2, label=LABELS[case])
        data[f"{LABELS[case]} [m/s]"] = velocity
        if case in BARRIERS:
            data[f"bound, {LABELS[case]} [m/s]"] = bound(outcome)[:ticks]
            _mark(axes, outcome, case, time)
    for marker, _, meaning in _MARKERS.values():
        axes.plot([], [], marker, ms=7, color="white", mec="black", label=meaning)
    axes.margins(x=0.02)
    axes.set_ylim(bottom=floor)
    axes.set_xlabel("time after the event began [s]")
    label(axes, "CoM velocity in x", "m/s")
    legend(axes, 4)
    caption = f"Fig. 7, {event}. Triangle: the barrier first acts; cross: h first < 0 (none: never)."
    return Picture(name, caption, figure, data)


def _mark(axes: Axes, outcome: Outcome, case: str, time: np.ndarray) -> None:
    for tick, (marker, size, _) in ((outcome.acts, _MARKERS["acts"]), (outcome.notices, _MARKERS["notices"])):
        if tick < len(time):
            at = round(tick)
            colour = palette.CASES[case]
            axes.plot(time[at], speed(outcome)[at], marker, ms=size, color=colour, mec="black", zorder=5)


def _phases(by_size: Mapping[float, Mapping[str, list[Outcome]]]) -> Picture:
    figure = Figure(figsize=(8.5, 2.0 * len(KICKS) + 0.8))
    axes = figure.subplots(len(KICKS), 1, sharex=True)
    period = len(by_size[KICKS[0]][NONE])
    data: dict[str, np.ndarray] = {"phase [ticks]": np.arange(period)}
    for axis, (size, cases) in zip(axes, by_size.items(), strict=True):
        for case, outcomes in cases.items():
            recovers = np.array([o.recovers for o in outcomes])
            seen = np.array([o.notices == 0 for o in outcomes])
            axis.plot(recovers, color=palette.CASES[case], ls=STYLES[case], label=LABELS[case])
            data[f"{1e3 * size:g} mm/s: recovery, {LABELS[case]} [ticks]"] = recovers
            if case in BARRIERS:
                height = np.full(seen.sum(), 0.12 if case == DCBF else 0.04)
                axis.plot(
                    np.flatnonzero(seen),
                    height,
                    "s",
                    ms=4,
                    color=palette.CASES[case],
                    transform=axis.get_xaxis_transform(),
                )
                data[f"{1e3 * size:g} mm/s: h < 0 at once, {LABELS[case]} [0/1]"] = seen.astype(float)
        axis.set_title(f"kick of {1e3 * size:g} mm/s", loc="right")
        top = axis.get_ylim()[1]
        axis.set_ylim(-0.25 * top, top)
        axis.set_yticks([tick for tick in axis.get_yticks() if 0 <= tick <= top])
        label(axis, "recovery", "ticks")
    axes[-1].set_xlabel("phase of the step at which the kick comes [ticks]")
    legend(axes[0], 3)
    caption = (
        f"Fig. 7, kicks at all {period} phases: ticks until the velocity stays within {1e3 * PAPER_PERIODIC:g} mm/s "
        "above the nominal one. "
        "Squares below: phases at which the barrier's own h < 0 at once."
    )
    return Picture("fig7_phases", caption, figure, data)


def _definitions() -> str:
    return (
        "The same event meets the same settled walk under Case 1, Case 2 and no barrier (γ = 0.5, soft). A barrier "
        "notices when its own h < 0 on the measured state; it acts when the controller's ZMP velocity differs from "
        f"what the same program without the barrier would do from the same state, by {1e3 * ACTS:g} mm/s more than it "
        f"ever does in an undisturbed gait; the walk has recovered once the velocity stays within "
        f"{1e3 * PAPER_PERIODIC:g} mm/s above the nominal one."
    )
