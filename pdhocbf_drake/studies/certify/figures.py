"""Figures of a certificate: the safe tube, its sections, areas and largest pushes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.drawing import label, legend, panels, save, styled
from pdhocbf_drake.barriers import AffineBarrier
from pdhocbf_drake.files.file import replaced_file
from pdhocbf_drake.sets.polytope import Array, Polytope
from pdhocbf_drake.studies.certify.disturbance_figure import disturbed_sections
from pdhocbf_drake.studies.certify.phase_plots import phase_plots
from pdhocbf_drake.studies.certify.scenario_certificate import ScenarioCertificate
from pdhocbf_drake.walking.quantities import SPEEDS

_ANGLES = np.linspace(0.0, 2.0 * np.pi, 481)

Parts = list[Polytope | None]


def write_certificate_figures(found: ScenarioCertificate, data: dict[str, Any], folder: Path) -> None:
    """Writes each figure as a PNG."""
    with styled():
        figures = {"safe_tube": safe_tube(found), "sections": sections(found, data), "pushes": pushes(found, data)}
        if found.axes[found.main_axis].disturbance is not None:
            figures["disturbance"] = disturbed_sections(found)
        for name, figure in figures.items():
            with replaced_file(folder / f"{name}.png") as staging:
                save(figure, staging)


def sections(found: ScenarioCertificate, data: dict[str, Any]) -> Figure:
    """The sets in (c, v) at a few phases, with the orbit, the bounds and the limits of ZMP and reach behind them."""
    axis = found.main_axis
    certificate, name = found.axes[axis], "xy"[axis]
    period = certificate.template.period
    listed, free = data["axes"][name]["phases"], data["axes"][name]["without_barriers"]["phases"]

    def draw(plot: Axes, phase: int) -> None:
        _filled(plot, free[phase]["vertices"], palette.LIMIT, 0.18, "can walk on for ever")
        if certificate.bounds:
            _filled(plot, listed[phase]["vertices"], palette.SAFE, 0.55, "can also keep the bounds")
        for index, bound in enumerate(certificate.bounds):
            colour = palette.BARRIERS[(index + 1) % len(palette.BARRIERS)]
            _bound_line(plot, bound.barrier, phase, colour)
        plot.plot(*found.orbit[axis, :period, :2].T, color="black", lw=0.6, alpha=0.5)
        plot.plot(*found.orbit[axis, phase, :2], "ko", ms=5, label="nominal orbit, here")

    return phase_plots(axis, period, draw, columns=4)


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
        if template.chooses_steps:
            for start in _fixed_from(template.coming):
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


def safe_tube(found: ScenarioCertificate) -> Figure:
    """The safe tube: the certified set at each phase over phase, CoM and velocity, with the nominal orbit inside."""
    axis = found.main_axis
    certificate, name = found.axes[axis], "xy"[axis]
    template = certificate.template
    phases = np.arange(template.period)
    orbit = found.orbit[axis, phases, :2]
    free: Parts = [certificate.section(int(phase), certificate.unbounded) for phase in phases]
    kept: Parts = [certificate.section(int(phase)) for phase in phases]
    figure = Figure(figsize=(10.0, 6.4))
    figure.set_layout_engine("none")
    plot: Axes3D = figure.add_axes((-0.03, -0.02, 1.0, 0.98), projection="3d", computed_zorder=False)
    # Runs of phases over which the section changes smoothly.
    pieces = np.split(phases, np.flatnonzero(np.diff(template.coming.astype(int))) + 1)
    if certificate.bounds:
        _tube(plot, free, pieces, palette.LIMIT, 0.13, 1)
    _tube(plot, kept, pieces, palette.SAFE, 0.42, 2)
    plot.plot(phases, orbit[:, 0], orbit[:, 1], color="black", lw=3.0, zorder=10)
    plot.set_xlabel(f"phase of the step [ticks of {1000 * template.tick:g} ms]", labelpad=18)
    plot.set_ylabel(f"CoM {name} from the foot [m]", labelpad=8)
    plot.set_zlabel(f"{SPEEDS[axis].label} [{SPEEDS[axis].unit}]", labelpad=4)
    plot.set_box_aspect((2.3, 1.0, 1.05), zoom=1.13)
    plot.view_init(elev=22, azim=-62)
    plot.set_xlim(0, len(phases))
    for side in (plot.xaxis, plot.yaxis, plot.zaxis):
        side.pane.set_alpha(0.2)
    for start in _fixed_from(template.coming)[:1]:  # from here the tube narrows because the next foothold is fixed
        if (part := free[int(start)]) is not None:
            com, velocity = part.vertices[part.vertices[:, 1].argmax()]
            plot.text(start, com, velocity + 0.25, "next foothold fixed", fontsize=9.5, color=palette.LIMIT, zorder=12)
    asked = "be kept under its bound" if certificate.bounds else "go on"
    figure.text(0.03, 0.945, f"From where can the walk {asked} for ever?", fontsize=14)
    figure.legend(handles=_handles(plot, found), loc="upper left", bbox_to_anchor=(0.02, 0.935), fontsize=10)
    return figure


def _handles(plot: Axes3D, found: ScenarioCertificate) -> list[Any]:
    bounds = found.axes[found.main_axis].bounds
    names = "the bound " + bounds[0].barrier.name if len(bounds) == 1 else "all bounds"
    safe = f"from here {names} can be kept for ever" if bounds else "from here it can"
    patches = plot.plot([], [], [], color=palette.SAFE, lw=7, alpha=0.6, label=safe)
    if bounds:
        free = "from here it can walk on without the bound"
        patches += plot.plot([], [], [], color=palette.LIMIT, lw=7, alpha=0.25, label=free)
    return patches + plot.plot([], [], [], color="black", lw=3.0, label="nominal orbit")


def _fixed_from(coming: np.ndarray) -> np.ndarray:
    """Phases from which on the next foothold is fixed."""
    return np.flatnonzero(np.diff(coming.astype(int), prepend=0) == 1)


def _tube(plot: Axes3D, parts: Parts, pieces: list[np.ndarray], colour: str, alpha: float, order: int) -> None:
    """The side surface of each piece, with outlines that show its depth."""
    for piece in pieces:
        there = [(int(phase), part) for phase in piece if (part := parts[phase]) is not None]
        if len(there) > 1:
            rims = np.array([_rim(part) for _, part in there])
            along = np.repeat([[float(phase)] for phase, _ in there], len(_ANGLES), axis=1)
            plot.plot_surface(
                along, rims[:, :, 0], rims[:, :, 1], color=colour, alpha=alpha, linewidth=0, antialiased=True,
                rstride=1, cstride=1, shade=False, zorder=order,
            )  # fmt: skip
        for phase, part in dict([*there[::4], *there[-1:]]).items():
            ring = part.outline
            face = [np.column_stack([np.full(len(ring), phase), ring])]
            edge = Poly3DCollection(face, facecolor="none", edgecolor=colour, lw=0.8, alpha=0.9, zorder=order + 2)
            plot.add_collection3d(edge)


def _rim(part: Polytope) -> Array:
    """The boundary along rays from the centre, evenly spaced in the polygon's own proportions, shape (angles, 2)."""
    stretch = np.linalg.cholesky(np.cov(part.vertices.T))
    rays = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)]) @ stretch.T
    speed = rays @ part.A.T
    slack = part.b - part.A @ part.centre
    reach = np.where(speed > 1e-12, slack / np.where(speed > 1e-12, speed, 1.0), np.inf).min(axis=1)
    return np.asarray(part.centre + reach[:, None] * rays)
