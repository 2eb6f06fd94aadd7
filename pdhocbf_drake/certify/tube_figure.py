"""The safe tube around the orbit: CoM, velocity, and the phase of the step as third axis."""

from __future__ import annotations

import numpy as np
from matplotlib.colors import LightSource
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.barriers.polytope import Array, Polytope
from pdhocbf_drake.certify.scenario_certificate import ScenarioCertificate

_ANGLES = 181


def safe_tube(found: ScenarioCertificate) -> Figure:
    """The set kept for ever at each phase, stacked over the step, with the nominal orbit inside."""
    axis = found.main_axis
    certificate, name = found.axes[axis], "xy"[axis]
    phases = np.arange(certificate.template.period)
    orbit = found.orbit[axis, phases, :2]
    bounded = bool(certificate.bounds)
    figure = Figure(figsize=(9.0, 7.2))
    plot: Axes3D = figure.add_subplot(projection="3d", computed_zorder=False)
    outer = [certificate.section(int(phase), certificate.unbounded) for phase in phases]
    inner = [certificate.section(int(phase)) for phase in phases]
    if bounded:
        _tube(plot, outer, orbit, palette.LIMIT, 0.10, light=False)
        _rims(plot, outer, palette.LIMIT, 0.5, 0.7)
    _tube(plot, inner, orbit, palette.SAFE, 0.55, light=True)
    _rims(plot, inner, palette.SAFE, 0.9, 0.9)
    plot.plot(orbit[:, 0], orbit[:, 1], phases, color="black", lw=2.5, zorder=10)
    plot.plot(orbit[::5, 0], orbit[::5, 1], phases[::5], ls="none", marker="o", ms=4, color="black", zorder=11)
    handles = [
        plot.plot([], [], color=palette.SAFE, lw=6, alpha=0.7, label=_inner_name(found))[0],
        plot.plot([], [], color="black", lw=2.5, marker="o", ms=4, label="nominal orbit")[0],
    ]
    if bounded:
        outer_line = plot.plot([], [], color=palette.LIMIT, lw=6, alpha=0.3, label="can walk on for ever, no bound")[0]
        handles.insert(1, outer_line)
    _mark_choices(plot, found)
    plot.set_xlabel(f"CoM {name} from the stance foot [m]", labelpad=9)
    plot.set_ylabel(f"CoM velocity in {name} [m/s]", labelpad=9)
    plot.set_zlabel(f"phase [ticks of {1000 * certificate.template.tick:g} ms]", labelpad=6)
    plot.set_box_aspect((1.15, 1.15, 1.35), zoom=0.93)
    plot.view_init(elev=17, azim=-58)
    for side in (plot.xaxis, plot.yaxis, plot.zaxis):
        side.pane.set_alpha(0.25)
    plot.set_zlim(0, len(phases))
    figure.suptitle(f"From where can the walk be kept {'under its bound ' if bounded else ''}for ever?", fontsize=13)
    figure.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, 0.945), ncols=3, fontsize=9.5)
    return figure


def _inner_name(found: ScenarioCertificate) -> str:
    bounds = found.axes[found.main_axis].bounds
    if not bounds:
        return "can walk on for ever"
    return "can also keep " + (f"the bound {bounds[0].barrier.name}" if len(bounds) == 1 else "all bounds")


def _mark_choices(plot: Axes3D, found: ScenarioCertificate) -> None:
    """Says where the next foothold is fixed, since the tube narrows there for that reason alone."""
    template = found.axes[found.main_axis].template
    if not template.chooses_steps or not template.coming.any():
        return
    low, high = plot.get_xlim()
    place = float(np.flatnonzero(template.coming)[0])
    text = "  the next foothold\n  is fixed from here on"
    plot.text(high, plot.get_ylim()[1], place, text, fontsize=8.5, color=palette.LIMIT, zorder=12)
    plot.plot([low, high], [plot.get_ylim()[1]] * 2, [place] * 2, color=palette.LIMIT, lw=0.8, ls=":", zorder=0)


def _tube(plot: Axes3D, parts: list[Polytope | None], orbit: Array, colour: str, alpha: float, light: bool) -> None:
    """The side surface, sampled along rays from an inner point; pieces where the set is empty stay away."""
    angles = np.linspace(0.0, 2.0 * np.pi, _ANGLES)
    known = [phase for phase, part in enumerate(parts) if part is not None]
    if len(known) < 2:
        return
    rims = np.array([_rim(parts[phase], orbit[phase], angles) for phase in known])
    heights = np.repeat(np.array(known, dtype=float)[:, None], _ANGLES, axis=1)
    shading = {"lightsource": LightSource(azdeg=225, altdeg=35)} if light else {"shade": False}
    plot.plot_surface(
        rims[:, :, 0], rims[:, :, 1], heights, color=colour, alpha=alpha, linewidth=0, antialiased=True,
        rstride=1, cstride=2, zorder=2 if light else 1, **shading,
    )  # fmt: skip


def _rim(part: Polytope | None, point: Array, angles: Array) -> Array:
    """The boundary seen from a point (the orbit, or the centre where that is outside), shape (angles, 2)."""
    if part is None:
        return np.full((len(angles), 2), np.nan)
    scale = np.ptp(part.vertices, axis=0)
    inner = point if part.violation(point) < -1e-9 else part.centre
    rays = np.column_stack([np.cos(angles), np.sin(angles)]) * scale
    speed = rays @ part.A.T
    slack = part.b - part.A @ inner
    reach = np.where(speed > 1e-12, slack / np.where(speed > 1e-12, speed, 1.0), np.inf).min(axis=1)
    return np.asarray(inner + reach[:, None] * rays)


def _rims(plot: Axes3D, parts: list[Polytope | None], colour: str, alpha: float, width: float) -> None:
    """Outlines at a few phases, which the eye needs to read depth."""
    count = len(parts)
    for phase in (*range(0, count, max(1, count // 8)), count - 1):
        part = parts[phase]
        if part is not None:
            ring = np.array(_ordered(part))
            face = [np.column_stack([ring, np.full(len(ring), phase)])]
            plot.add_collection3d(Poly3DCollection(face, facecolor="none", edgecolor=colour, lw=width, alpha=alpha))


def _ordered(part: Polytope) -> Array:
    centred = (part.vertices - part.centre) / np.ptp(part.vertices, axis=0)
    return np.asarray(part.vertices[np.argsort(np.arctan2(centred[:, 1], centred[:, 0]))])
