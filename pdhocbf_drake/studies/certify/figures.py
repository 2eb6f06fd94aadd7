"""Figures of a certificate: the safe tube, its sections, areas and largest pushes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.drawing import label, legend, panels, save, styled
from pdhocbf_drake.barriers import AffineBarrier
from pdhocbf_drake.studies.certify.scenario_certificate import ScenarioCertificate
from pdhocbf_drake.studies.certify.tube_figure import safe_tube
from pdhocbf_drake.walking.quantities import SPEEDS

_SHOWN = 6


def write_certificate_figures(found: ScenarioCertificate, data: dict[str, Any], folder: Path) -> None:
    """Writes each figure as a PNG."""
    folder.mkdir(exist_ok=True)
    with styled():
        figures = {"safe_tube": safe_tube(found), "sections": sections(found, data), "pushes": pushes(found, data)}
        for name, figure in figures.items():
            save(figure, folder / f"{name}.png")


def sections(found: ScenarioCertificate, data: dict[str, Any]) -> Figure:
    """The sets in (c, v) at a few phases, with the orbit, the bounds and the limits of ZMP and reach behind them."""
    axis = found.main_axis
    certificate, name = found.axes[axis], "xy"[axis]
    period = certificate.template.period
    listed, free = data["axes"][name]["phases"], data["axes"][name]["without_barriers"]["phases"]
    figure = Figure(figsize=(9.0, 5.6))
    plots = figure.subplots(2, _SHOWN // 2, sharex=True, sharey=True)
    for plot, phase in zip(plots.flat, np.linspace(0, period - 1, _SHOWN).round().astype(int), strict=True):
        _filled(plot, free[phase]["vertices"], palette.LIMIT, 0.18, "can walk on for ever")
        if certificate.bounds:
            _filled(plot, listed[phase]["vertices"], palette.SAFE, 0.55, "can also keep the bounds")
        for index, bound in enumerate(certificate.bounds):
            colour = palette.BARRIERS[(index + 1) % len(palette.BARRIERS)]
            _bound_line(plot, bound.barrier, phase, colour)
        plot.plot(*found.orbit[axis, :period, :2].T, color="black", lw=0.6, alpha=0.5)
        plot.plot(*found.orbit[axis, phase, :2], "ko", ms=5, label="nominal orbit, here")
        plot.set_title(f"phase {phase}")
    for plot in plots[:, 0]:
        label(plot, SPEEDS[axis].label, SPEEDS[axis].unit)
    for plot in plots[-1]:
        plot.set_xlabel(f"CoM {name} from the foot [m]")
    handles, names = plots.flat[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper left", ncols=4)
    return figure


def pushes(found: ScenarioCertificate, data: dict[str, Any]) -> Figure:
    """Area and largest admissible push along the step, with and without the bounds."""
    axis = found.main_axis
    name, template = "xy"[axis], found.axes[axis].template
    main = data["axes"][name]
    figure, (areas, impulses) = panels(2, height=2.5)
    drawn = [("no barrier", main["without_barriers"]["phases"], palette.LIMIT)]
    if found.axes[axis].bounds:
        drawn.append(("with the barriers", main["phases"], palette.SAFE))
    for what, phases, colour in drawn:
        areas.step(range(len(phases)), [p["area"] for p in phases], color=colour, label=what, where="post")
        for key in ("push_max", "push_min"):
            values = [np.nan if p[key] is None else p[key] for p in phases]
            impulses.plot(values, color=colour, label=what if key == "push_max" else "_")
    for plot in (areas, impulses):
        if template.chooses_steps and template.coming.any():
            for start in np.flatnonzero(np.diff(template.coming.astype(int), prepend=0) == 1):
                end = start + template.coming[start:].argmin() if not template.coming[start:].all() else len(phases)
                plot.axvspan(float(start), float(end), color=palette.BOX, alpha=0.3, lw=0)
        legend(plot)
    impulses.axhline(0.0, color="black", lw=0.8)
    label(areas, "area of the set", "m²/s")
    label(impulses, f"largest push in {name}", "N s")
    impulses.set_xlabel(f"phase [ticks of {1000 * template.tick:g} ms]; shaded: the next foothold is fixed")
    impulses.set_title(f"{data['push_seconds']:g} s, {data['mass']:.0f} kg, best response", loc="right")
    impulses.margins(x=0)
    return figure


def _bound_line(plot: Axes, barrier: AffineBarrier, phase: int, colour: str) -> None:
    """The edge n·[c, v] = V̄(k) of the safe half-plane."""
    (on_com, on_velocity), limit = barrier.normals(phase, 1)[0, :2], barrier.bound(phase)
    style: dict[str, Any] = {"color": colour, "lw": 1.2, "label": f"bound of {barrier.name}"}
    if on_velocity == 0.0:
        plot.axvline(limit / on_com, **style)
    else:
        plot.axline((0.0, limit / on_velocity), slope=-on_com / on_velocity, **style)


def _filled(plot: Axes, vertices: list[list[float]], colour: str, alpha: float, name: str) -> None:
    if vertices:
        plot.fill(*np.array(vertices).T, facecolor=colour, alpha=alpha, edgecolor="none", label=name)
        plot.plot(*np.array([*vertices, vertices[0]]).T, color=colour, lw=1.0)
