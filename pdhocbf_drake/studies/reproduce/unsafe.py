"""Fig. 7 as an experiment on the template: kicks at every phase, a sustained push, a wrong speed command."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.drawing import label, legend, panels
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.reproduce import unsafe_findings as findings
from pdhocbf_drake.studies.reproduce.calibration import PAPER_PERIODIC
from pdhocbf_drake.studies.reproduce.report import LABELS, STYLES, Number, Picture, Section
from pdhocbf_drake.studies.reproduce.runs import Request, Runs
from pdhocbf_drake.studies.reproduce.unsafe_findings import BARRIERS, bound, count, speed
from pdhocbf_drake.studies.shared.cases import CASES, DCBF, NONE, PERIODIC
from pdhocbf_drake.studies.shared.measures import ACTS, Array, Outcome
from pdhocbf_drake.studies.shared.template import Laboratory
from pdhocbf_drake.walking import GaitConfig

SCENARIO: Request = ("paper_vhip", "barriers: {forward_speed: {gamma: [0.5, 0.5]}}")
KICKS = (0.01, 0.02, 0.03, 0.05)  # [m/s]
SHOWN_KICK, SHOWN_PHASE = 0.02, 15  # where the constant bound is far away
PUSHES = (0.05, 0.1, 0.2, 0.4)  # [m/s²], for one step
COMMANDS = (0.152, 0.155, 0.16, 0.17, 0.18)  # [m] a step, where 0.15 m is right
_TICKS, _COMMANDED_TICKS = 120, 200
_SHOWN_COMMAND, _SHOWN_PUSH = 0.16, 0.2
_MARKERS = (("^", 13, "first acts"), ("X", 8, "first h < 0"))  # the larger one shows behind the other
_DEFINITIONS = (
    "The same event meets the same settled walk under Case 1, Case 2 and no barrier (γ = 0.5, soft). A barrier notices "
    "an event when its own h < 0 on the measured state; it acts when the controller's ZMP velocity differs from that "
    f"of the same program without the barrier, planned from the same state, by {1e3 * ACTS:g} mm/s more than it ever "
    f"does in an undisturbed gait; the walk has recovered once the velocity stays within {1e3 * PAPER_PERIODIC:g} mm/s "
    "above the nominal one."
)


def figure_7(runs: Runs) -> Section:
    """The section: which kicks each barrier notices, when it acts, and how soon the walk recovers."""
    scenario = load_scenario(*SCENARIO)
    laboratory, gait = Laboratory(scenario), scenario.gait
    period, tick, stride = gait.ticks_per_step, gait.tick, gait.stride
    nominal = laboratory.walks[NONE].undisturbed.states[:period, 0, 1]
    step = f"{period * tick:g} s"
    kicks: dict[float, dict[str, list[Outcome]]] = {}
    for size in KICKS:
        runs.report(f"velocity kicks of {1e3 * size:g} mm/s at {period} phases, three cases")
        kick = np.array([[size, 0.0]])
        kicks[size] = {c: [laboratory.kicked(c, q, kick, _TICKS) for q in range(period)] for c in CASES}
    runs.report("sustained pushes and wrong speed commands")
    push = np.tile([tick, 0.0], (period, 1))  # of 1 m/s²
    pushes = {a: {c: laboratory.kicked(c, 0, a * push, _TICKS) for c in CASES} for a in PUSHES}
    orders = {length: {c: laboratory.commanded(c, length, 1, _COMMANDED_TICKS) for c in CASES} for length in COMMANDS}
    shown = {case: kicks[SHOWN_KICK][case][SHOWN_PHASE] for case in CASES}
    wrong = f"steps of {_SHOWN_COMMAND:g} m commanded instead of {stride:g} m"
    events = [
        ("fig7_kick", f"a kick of {1e3 * SHOWN_KICK:g} mm/s at phase {SHOWN_PHASE} of {period}", shown, 60),
        ("fig7_push", f"a push of {_SHOWN_PUSH:g} m/s² for {step}", pushes[_SHOWN_PUSH], 100),
        ("fig7_command", wrong, orders[_SHOWN_COMMAND], 200),
    ]
    noticed = [
        Number(f"kick of {1e3 * size:g} mm/s: phases of {period} at which {LABELS[case]} has h < 0 at once",
            None, count(o.notices == 0 for o in kicks[size][case]), "phases")
        for size in KICKS for case in BARRIERS
    ]  # fmt: skip
    return Section(
        "Fig. 7: unsafe events, as an experiment",
        [_DEFINITIONS, *findings.conclusions(kicks, orders, nominal)],
        [*(_trajectories(gait, nominal, *event) for event in events), _phases(kicks)],
        [findings.kick_table(kicks), findings.push_table(pushes, step), findings.command_table(orders, stride)],
        noticed,
        findings.finding(kicks, pushes, orders),
    )


def _trajectories(
    gait: GaitConfig, orbit: Array, name: str, event: str, outcomes: Mapping[str, Outcome], ticks: int
) -> Picture:
    """The velocity after one event in all cases, with both safe zones; `orbit` is the nominal one over a step."""
    figure, (axes,) = panels(1, height=3.6)
    time = gait.tick * np.arange(ticks)
    nominal = orbit[(outcomes[NONE].record.first + np.arange(ticks)) % gait.ticks_per_step]
    floor = min(float(nominal.min()), *(float(speed(o)[:ticks].min()) for o in outcomes.values())) - 0.01
    zones: dict[str, dict[str, Any]] = {
        DCBF: {"fc": palette.CASES[DCBF], "alpha": 0.18},
        PERIODIC: {"hatch": "//", "fc": "none", "ec": palette.CASES[PERIODIC], "alpha": 0.5},
    }
    for case, zone in zones.items():
        axes.fill_between(time, floor, bound(outcomes[case])[:ticks], lw=0, label=f"safe zone, {LABELS[case]}", **zone)
    axes.plot(time, nominal, color=palette.MEASURED_COM, lw=1.0, label="nominal")
    data = {"time [s]": time, "nominal [m/s]": nominal}
    for case, outcome in outcomes.items():
        velocity, colour = speed(outcome)[:ticks], palette.CASES[case]
        axes.plot(time, velocity, color=colour, ls=STYLES[case], lw=2, label=LABELS[case])
        data[f"{LABELS[case]} [m/s]"] = velocity
        if case in BARRIERS:
            data[f"bound, {LABELS[case]} [m/s]"] = bound(outcome)[:ticks]
            for event_tick, (marker, size, _) in zip((outcome.acts, outcome.notices), _MARKERS, strict=True):
                if event_tick < ticks:
                    at = round(event_tick)
                    axes.plot(time[at], velocity[at], marker, ms=size, color=colour, mec="black", zorder=5)
    for marker, _, meaning in _MARKERS:
        axes.plot([], [], marker, ms=7, color="white", mec="black", label=meaning)
    axes.margins(x=0.02)
    axes.set_ylim(bottom=floor)
    axes.set(xlabel="time after the event began [s]", ylabel="CoM velocity in x [m/s]")
    legend(axes, 4)
    caption = f"Fig. 7, {event}. Triangle: the barrier first acts; cross: h first < 0 (none: never)."
    return Picture(name, caption, figure, data)


def _phases(kicks: Mapping[float, Mapping[str, list[Outcome]]]) -> Picture:
    """Ticks until recovery by the phase of the kick, one panel for each size."""
    figure, axes = panels(len(KICKS), height=2.075)
    period = len(kicks[KICKS[0]][NONE])
    data: dict[str, np.ndarray] = {"phase [ticks]": np.arange(period)}
    for axis, (size, cases) in zip(axes, kicks.items(), strict=True):
        title = f"{1e3 * size:g} mm/s"
        for case, outcomes in cases.items():
            colour = palette.CASES[case]
            recovers = np.array([o.recovers for o in outcomes])
            at_once = np.array([o.notices == 0 for o in outcomes])
            axis.plot(recovers, color=colour, ls=STYLES[case], label=LABELS[case])
            data[f"{title}: recovery, {LABELS[case]} [ticks]"] = recovers
            if case in BARRIERS:
                height = np.full(at_once.sum(), 0.12 if case == DCBF else 0.04)
                place = axis.get_xaxis_transform()
                axis.plot(np.flatnonzero(at_once), height, "s", ms=4, color=colour, transform=place)
                data[f"{title}: h < 0 at once, {LABELS[case]} [0/1]"] = at_once.astype(float)
        axis.set_title(f"kick of {title}", loc="right")
        top = axis.get_ylim()[1]
        axis.set_ylim(-0.25 * top, top)
        axis.set_yticks([tick for tick in axis.get_yticks() if 0 <= tick <= top])
        label(axis, "recovery", "ticks")
    axes[-1].set_xlabel("phase of the step at which the kick comes [ticks]")
    legend(axes[0], 3)
    caption = (
        f"Fig. 7, kicks at all {period} phases: ticks until the velocity stays within {1e3 * PAPER_PERIODIC:g} mm/s "
        "above the nominal one. Squares below: phases at which the barrier's own h < 0 at once."
    )
    return Picture("fig7_phases", caption, figure, data)
