"""`pdhocbf worth`: what a barrier buys, measured: events under no, constant and periodic barriers over a range of γ."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pdhocbf_drake.analysis.drawing import styled
from pdhocbf_drake.analysis.palette import CASES
from pdhocbf_drake.arguments import add_overrides
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.run_folder import replaced_file
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.push.directions import parse_phases
from pdhocbf_drake.studies.push.folder import result_folder
from pdhocbf_drake.studies.push.measures import HEADER, Measures, summarised
from pdhocbf_drake.studies.push.variants import BARRIERS, NONE, told_of_borrowed
from pdhocbf_drake.studies.worth.robot import RobotWorth
from pdhocbf_drake.studies.worth.template import TemplateWorth

RESULT = "worth.json"
_DRAWN = {
    "excess": ("largest excess", "mm/s", 1e3),
    "recovers": ("recovery time", "s", 1.0),
    "acts": ("acts after", "ms", 1e3),
}
# Sizes of kick, push and command that the barrier can do something about: template [m/s, m/s²], robot [N s, N].
_SIZES = {"vhip": (0.02, 0.2), "biped": (3.0, 20.0)}
_COMMAND = 1.07
_FASTEST = 2.0  # times the right stride; beyond that no leg reaches


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A scenario, the events, the range of γ, and where to put what is found."""
    what = "a name from `pdhocbf list`, or FILE[:NAME]; a template (such as vhip) takes a minute, a robot several"
    parser.add_argument("scenario", metavar="SCENARIO", help=what)
    add_overrides(parser)
    parser.add_argument("--gamma", default="0.05,0.1,0.2,0.5,1", metavar="LIST", help="class-K rates in (0, 1]")
    parser.add_argument("--phases", default="8", metavar="N|LIST", help="ticks at which events begin, as for push")
    parser.add_argument("--kick", type=float, metavar="SIZE", help="velocity gained [m/s], or on a robot impulse [N s]")
    parser.add_argument("--push", type=float, metavar="SIZE", help="acceleration [m/s²], or on a robot force [N]")
    parser.add_argument(
        "--command", type=float, default=_COMMAND, metavar="FACTOR", help="commanded stride over the right one"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="the folder; otherwise ./runs/worth-NAME")


def run(options: argparse.Namespace) -> int:
    """Experiments, writes and tells; gives the exit code."""
    scenario = load_scenario(options.scenario, options.text)
    if scenario.system not in _SIZES:
        raise InputError(f"scenario.system: 'vhip' or 'biped' is needed (given: {scenario.system!r})")
    gammas = _gammas(options.gamma)
    for name in ("kick", "push", "command"):
        size = getattr(options, name)
        if size is not None and not (np.isfinite(size) and size > 0.0):
            raise InputError(f"--{name} must be a finite number above 0 (given: {size:g})")
    if options.command > _FASTEST:
        raise InputError(f"--command must be {_FASTEST:g} times the right stride at most (given: {options.command:g})")
    kick, push = _SIZES[scenario.system]
    sizes = (options.kick or kick, options.push or push, options.command)
    ticks = scenario.gait.ticks_per_step if scenario.system == "vhip" else scenario.gait.ticks_per_gait
    phases = parse_phases(options.phases, ticks)
    folder = result_folder(options.out, "worth", scenario)
    if told := told_of_borrowed(scenario):
        print(told, file=sys.stderr, flush=True)
    experiment = (TemplateWorth if scenario.system == "vhip" else RobotWorth)(scenario, *sizes, phases)
    rows = experiment.run(gammas, lambda words: print(f"worth: {words}", file=sys.stderr, flush=True))
    text = table(rows)
    print(text, flush=True)  # first, since what is found must not be lost with a disk
    with replaced_file(folder / "worth.png") as staging:
        draw(rows, staging)
    with replaced_file(folder / "worth.txt") as staging:
        staging.write_text(text + "\n", encoding="utf-8")
    with replaced_file(folder / RESULT) as staging:
        staging.write_text(json.dumps({"rows": [row.as_json() for row in rows]}, indent=1) + "\n", encoding="utf-8")
    print(f"wrote {folder / RESULT} and a figure beside it")
    return 0


def table(rows: Sequence[Measures]) -> str:
    """Medians over the phases, aligned."""
    cells = [HEADER, *summarised(rows)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(HEADER))]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in cells)


def draw(rows: Sequence[Measures], path: Path) -> None:
    """Each measure against γ, a column an event: median over the phases as a line, each phase as a dot."""
    events = list(dict.fromkeys(row.event for row in rows))
    with styled():
        figure = Figure(figsize=(3.4 * len(events) + 0.6, 2.3 * len(_DRAWN) + 0.6))
        grid = figure.subplots(len(_DRAWN), len(events), squeeze=False, sharex=True)
        for panels, (name, (what, unit, scale)) in zip(grid, _DRAWN.items(), strict=True):
            panels[0].set_ylabel(f"{what} [{unit}]")
            for axes, event in zip(panels, events, strict=True):
                for barrier in BARRIERS:
                    here = [row for row in rows if (row.event, row.barrier) == (event, barrier)]
                    values = [(row.gamma, getattr(row, name) * scale) for row in here]
                    _line(axes, values, barrier, CASES[barrier], name != "acts" or barrier != NONE)
                axes.set_xscale("log")
        for axes, event in zip(grid[0], events, strict=True):
            axes.set_title(event)
        for axes in grid[-1]:
            axes.set_xlabel("γ [1]")
        grid[0][0].legend()
        figure.savefig(path, format="png")


def _line(axes: Axes, values: Sequence[tuple[float, float]], barrier: str, colour: str, shown: bool) -> None:
    """One barrier's median over the phases, and its phases as dots."""
    if not shown or not values:
        return
    if barrier == NONE:
        known = [value for _, value in values if value == value]
        if known:
            axes.axhline(float(np.median(known)), color=colour, ls="--", label=barrier)
        return
    gammas = sorted({gamma for gamma, _ in values})
    groups = [[v for g, v in values if g == gamma and v == v] for gamma in gammas]
    axes.plot(gammas, [float(np.median(g)) if g else np.nan for g in groups], color=colour, marker="o", label=barrier)
    for gamma, group in zip(gammas, groups, strict=True):
        axes.plot([gamma] * len(group), group, ".", color=colour, alpha=0.3)


def _gammas(text: str) -> list[float]:
    try:
        gammas = [float(word) for word in text.split(",") if word.strip()]
    except ValueError:
        gammas = []
    if not gammas or not all(0.0 < gamma <= 1.0 for gamma in gammas):
        raise InputError(f"--gamma: a list of rates in (0, 1] is needed, such as 0.1,0.5 (given: {text!r})")
    return gammas
