"""The safe tube around the orbit: the phase of the step, CoM and velocity as the three axes."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.sets.polytope import Array, Polytope
from pdhocbf_drake.studies.certify.scenario_certificate import ScenarioCertificate
from pdhocbf_drake.walking.quantities import SPEEDS

_ANGLES = np.linspace(0.0, 2.0 * np.pi, 481)

Parts = list[Polytope | None]


def safe_tube(found: ScenarioCertificate) -> Figure:
    """The set kept for ever at each phase, strung along the step, with the nominal orbit inside."""
    axis = found.main_axis
    certificate, name = found.axes[axis], "xy"[axis]
    template = certificate.template
    phases = np.arange(template.period)
    orbit = found.orbit[axis, phases, :2]
    free: Parts = [certificate.section(int(phase), certificate.unbounded) for phase in phases]
    kept: Parts = [certificate.section(int(phase)) for phase in phases]
    bounded = bool(certificate.bounds)
    figure = Figure(figsize=(10.0, 6.4))
    figure.set_layout_engine("none")
    plot: Axes3D = figure.add_axes((-0.03, -0.02, 1.0, 0.98), projection="3d", computed_zorder=False)
    pieces = _pieces(template.coming)
    if bounded:
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
    _say_where_steps_are_fixed(plot, template.coming, free)
    figure.text(0.03, 0.945, _title(found), fontsize=14)
    figure.legend(handles=_handles(plot, found), loc="upper left", bbox_to_anchor=(0.02, 0.935), fontsize=10)
    return figure


def _title(found: ScenarioCertificate) -> str:
    if found.axes[found.main_axis].bounds:
        return "From where can the walk be kept under its bound for ever?"
    return "From where can the walk go on for ever?"


def _handles(plot: Axes3D, found: ScenarioCertificate) -> list[Any]:
    bounds = found.axes[found.main_axis].bounds
    names = "the bound " + bounds[0].barrier.name if len(bounds) == 1 else "all bounds"
    safe = f"from here {names} can be kept for ever" if bounds else "from here it can"
    patches = [plot.plot([], [], [], color=palette.SAFE, lw=7, alpha=0.6, label=safe)[0]]
    if bounds:
        patches += plot.plot(
            [], [], [], color=palette.LIMIT, lw=7, alpha=0.25, label="from here it can walk on without the bound"
        )
    return patches + plot.plot([], [], [], color="black", lw=3.0, label="nominal orbit")


def _say_where_steps_are_fixed(plot: Axes3D, coming: np.ndarray, free: Parts) -> None:
    """The tube narrows where the next foothold is no longer free, for that reason alone."""
    starts = np.flatnonzero(np.diff(coming.astype(int), prepend=0) == 1)
    for start in starts[:1]:
        part = free[int(start)]
        if part is not None:
            com, velocity = part.vertices[part.vertices[:, 1].argmax()]
            plot.text(start, com, velocity + 0.25, "next foothold fixed", fontsize=9.5, color=palette.LIMIT, zorder=12)


def _pieces(coming: np.ndarray) -> list[np.ndarray]:
    """Phases in runs over which the section changes smoothly."""
    phases = np.arange(len(coming))
    return np.split(phases, np.flatnonzero(np.diff(coming.astype(int))) + 1)


def _tube(plot: Axes3D, parts: Parts, pieces: list[np.ndarray], colour: str, alpha: float, order: int) -> None:
    """The side surface of each piece, with outlines that the eye needs to read depth."""
    for piece in pieces:
        known = [int(phase) for phase in piece if parts[phase] is not None]
        if len(known) > 1:
            rims = np.array([_rim(part) for phase in known if (part := parts[phase]) is not None])
            along = np.repeat(np.array(known, dtype=float)[:, None], len(_ANGLES), axis=1)
            plot.plot_surface(
                along, rims[:, :, 0], rims[:, :, 1], color=colour, alpha=alpha, linewidth=0, antialiased=True,
                rstride=1, cstride=1, shade=False, zorder=order,
            )  # fmt: skip
        for phase in {*known[::4], *known[:1], *known[-1:]}:
            part = parts[phase]
            if part is not None:
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
