"""Fig. 7 as an experiment on the template: kicks at every phase, a sustained push, a wrong speed command."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pdhocbf_drake.analysis.drawing import label, legend, panels
from pdhocbf_drake.studies.reproduce import look
from pdhocbf_drake.studies.reproduce.calibration import PAPER_PERIODIC
from pdhocbf_drake.studies.reproduce.events import CASES, SETTLED, Laboratory, Outcome, commanded, kicks
from pdhocbf_drake.studies.reproduce.record import Number, Picture, Section
from pdhocbf_drake.studies.reproduce.runs import Runs
from pdhocbf_drake.studies.reproduce.template_walk import run_template
from pdhocbf_drake.studies.reproduce.unsafe_findings import conclusions, finding
from pdhocbf_drake.studies.reproduce.unsafe_tables import BARRIERS, command_table, count, kick_table, push_table

KICKS = (0.01, 0.02, 0.03, 0.05)  # [m/s]
SHOWN_KICK, SHOWN_PHASE = 0.02, 15  # where the constant bound is far away
PUSHES = (0.05, 0.1, 0.2, 0.4)  # [m/s²], for one step
COMMANDS = (0.152, 0.155, 0.16, 0.17, 0.18)  # [m] a step, where 0.15 m is right
_TICKS = 120
_SHOWN_COMMAND, _SHOWN_PUSH = 0.16, 0.2
_MARKERS = {"acts": ("^", 13, "first acts"), "notices": ("X", 8, "first h < 0")}  # the larger shows behind the other
_COMMAND = "pdhocbf reproduce --only fig7"


def figure_7(runs: Runs) -> Section:
    """What each barrier notices, when it acts, and what that changes."""
    laboratory = Laboratory(runs)
    period, tick, stride = laboratory.period, laboratory.gait.tick, laboratory.gait.stride
    step = f"{period * tick:g} s"
    by_size: dict[float, Mapping[str, list[Outcome]]] = {}
    for size in KICKS:
        runs.tell(f"velocity kicks of {1e3 * size:g} mm/s at {period} phases, three cases")
        by_size[size] = kicks(laboratory, size, _TICKS)
    runs.tell("sustained pushes and wrong speed commands")
    pushes = {a: {c: laboratory.run(c, 0, np.full(period, a * tick), _TICKS) for c in CASES} for a in PUSHES}
    orders = {stride: _commanded(laboratory, stride) for stride in COMMANDS}
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
                f"kick of {1e3 * size:g} mm/s: phases of {period} at which {look.CASE_NAMES[case]} sees h < 0 at once",
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


def _commanded(laboratory: Laboratory, stride: float) -> dict[str, Outcome]:
    step = SETTLED // laboratory.period + 1
    walks = {case: commanded(walk, stride, step) for case, walk in laboratory.walks.items()}
    found = {}
    for case, walk in walks.items():
        without = walks["free"].mpc if case != "free" else None
        record, _ = run_template(walk, laboratory.start(case, 0), SETTLED, 200, None, without)
        found[case] = laboratory.judged(walk, record)
    return found


def _trajectories(
    laboratory: Laboratory, name: str, event: str, outcomes: Mapping[str, Outcome], ticks: int
) -> Picture:
    figure, (axes,) = panels(1, height=3.6)
    time = laboratory.gait.tick * np.arange(ticks)
    phases = (outcomes["free"].record.first + np.arange(ticks)) % laboratory.period
    nominal = laboratory.nominal[phases]
    low = min(float(o.record.speed[:ticks].min()) for o in outcomes.values())
    floor = min(low, float(nominal.min())) - 0.01
    for case in BARRIERS:
        bound = outcomes[case].bound[:ticks]
        zone: dict[str, Any] = (
            {"hatch": "//", "fc": "none", "ec": look.PERIODIC, "alpha": 0.5}
            if case == "periodic"
            else {"fc": look.CONSTANT, "alpha": 0.18}
        )
        axes.fill_between(time, floor, bound, lw=0, label=f"safe zone, {look.CASE_NAMES[case]}", **zone)
    axes.plot(time, nominal, color=look.NOMINAL, lw=1.0, label="nominal")
    data = {"time [s]": time, "nominal [m/s]": nominal}
    for case, outcome in outcomes.items():
        speed = outcome.record.speed[:ticks]
        axes.plot(
            time, speed, color=look.CASE_COLOURS[case], ls=look.CASE_STYLES[case], lw=2, label=look.CASE_NAMES[case]
        )
        data[f"{look.CASE_NAMES[case]} [m/s]"] = speed
        if case in BARRIERS:
            data[f"bound, {look.CASE_NAMES[case]} [m/s]"] = outcome.bound[:ticks]
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
            colour = look.CASE_COLOURS[case]
            axes.plot(time[at], outcome.record.speed[at], marker, ms=size, color=colour, mec="black", zorder=5)


def _phases(by_size: Mapping[float, Mapping[str, list[Outcome]]]) -> Picture:
    figure = Figure(figsize=(8.5, 2.0 * len(KICKS) + 0.8))
    axes = figure.subplots(len(KICKS), 1, sharex=True)
    period = len(by_size[KICKS[0]]["free"])
    data: dict[str, np.ndarray] = {"phase [ticks]": np.arange(period)}
    for axis, (size, cases) in zip(axes, by_size.items(), strict=True):
        for case, outcomes in cases.items():
            recovers = np.array([o.recovers for o in outcomes])
            seen = np.array([o.notices == 0 for o in outcomes])
            axis.plot(recovers, color=look.CASE_COLOURS[case], ls=look.CASE_STYLES[case], label=look.CASE_NAMES[case])
            data[f"{1e3 * size:g} mm/s: recovery, {look.CASE_NAMES[case]} [ticks]"] = recovers
            if case in BARRIERS:
                height = np.full(seen.sum(), 0.12 if case == "constant" else 0.04)
                axis.plot(
                    np.flatnonzero(seen),
                    height,
                    "s",
                    ms=4,
                    color=look.CASE_COLOURS[case],
                    transform=axis.get_xaxis_transform(),
                )
                data[f"{1e3 * size:g} mm/s: h < 0 at once, {look.CASE_NAMES[case]} [0/1]"] = seen.astype(float)
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
        "notices when its own h < 0 on the measured state; it acts when the controller's ZMP velocity differs by more "
        "than 10 mm/s from what the same program without the barrier would do from the same state; the walk has "
        f"recovered once the velocity stays within {1e3 * PAPER_PERIODIC:g} mm/s above the nominal one."
    )
