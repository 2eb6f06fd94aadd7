"""The two plots that matter: what a tick costs by route, and how that grows."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from pdhocbf_drake.analysis.drawing import styled
from pdhocbf_drake.analysis.palette import LIMIT, RUNS


def draw(results: dict[str, Any]) -> dict[str, Figure]:
    """The figures by name."""
    with styled():
        return {"routes": _routes(results), "growth": _growth(results)}


def _routes(results: dict[str, Any]) -> Figure:
    figure = Figure(figsize=(7.5, 3.6), layout="constrained")
    axes = figure.subplots()
    names = list(results["ticks"]["nominal"])
    for offset, (run, colour) in enumerate(zip(("nominal", "perturbed"), RUNS, strict=False)):
        times = [results["ticks"][run][name] for name in names]
        places = [i + 0.36 * (offset - 0.5) for i in range(len(names))]
        medians = [1e6 * each["seconds_median"] for each in times]
        above = [max(0.0, 1e6 * (each["seconds_p99"] - each["seconds_median"])) for each in times]
        axes.barh(places, medians, 0.34, xerr=[[0.0] * len(names), above], color=colour, label=f"{run} (to p99)")
    axes.set_xscale("log")
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.grid(axis="y", visible=False)
    axes.set_xlabel("time of a tick, x and y [µs]")
    axes.legend()
    return figure


def _growth(results: dict[str, Any]) -> Figure:
    figure = Figure(figsize=(5.5, 3.6), layout="constrained")
    axes = figure.subplots()
    gaits = sorted({row["ticks_per_gait"] for row in results["growth"]})
    for gait, colour in zip(gaits, RUNS, strict=False):
        rows = sorted(
            (row["horizon"], 1e6 * row["tick_seconds_median"])
            for row in results["growth"]
            if row["ticks_per_gait"] == gait
        )
        axes.plot(*zip(*rows, strict=True), "o-", color=colour, label=f"gait of {gait} ticks")
    first = min((row["horizon"], 1e6 * row["tick_seconds_median"]) for row in results["growth"])
    last = max(row["horizon"] for row in results["growth"])
    axes.plot([first[0], last], [first[1], first[1] * (last / first[0]) ** 2], ":", color=LIMIT, label="H²")
    axes.set(xscale="log", yscale="log", xlabel="horizon H [ticks]", ylabel="time of a tick [µs]")
    axes.legend()
    return figure
