"""The picture of an imported robot: front, side and soles, with joint axes in the colours of their roles."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.importing.triangles import Pictured, pictured
from pdhocbf_drake.robot import SIDES, Biped, sole_pose, upright_posture
from pdhocbf_drake.robot.per_joint import ROLES

_MOST = 30_000  # triangles that are drawn
_LIGHT = np.array([0.5, 0.3, 0.8]) / np.linalg.norm([0.5, 0.3, 0.8])
_SHELL = "#B8BDC4"
_SOLE = "#000000"  # a colour that no role has
_DASHES = {"left": (1.0, 0.0), "right": (1.2, 0.6)}  # lengths of a line and of the gap after it


def robot_picture(biped: Biped) -> Figure:
    """The robot standing at its CoM height, from the front and from its left, and its soles from above."""
    half = biped.config.stance_width / 2.0
    com = np.array([0.0, 0.0, biped.config.com_height])
    seen = pictured(biped, upright_posture(biped, com, sole_pose(0.0, half), sole_pose(0.0, -half)))
    figure = Figure(figsize=(10.0, 6.5))
    front, side, above = figure.subplots(1, 3, gridspec_kw={"width_ratios": (1.0, 1.0, 0.8)})
    _draw_body(front, seen, biped, across=1, depth=0)
    _draw_body(side, seen, biped, across=0, depth=1)
    for axes, title, label in ((front, "from the front", "y, left [m]"), (side, "from the left", "x, ahead [m]")):
        axes.set_title(title)
        axes.set_xlabel(label)
        axes.set_ylabel("z [m]")
        axes.axhline(0.0, color=palette.LIMIT, linewidth=0.8)
        axes.plot([0.0], [com[2]], "o", color="white", markeredgecolor=palette.MEASURED_COM, markersize=8, zorder=6)
        axes.plot([0.0], [com[2]], "+", color=palette.MEASURED_COM, markersize=8, zorder=7)
        axes.set_aspect("equal")
    _draw_soles(above, seen, biped)
    handles = [front.plot([], [], color=colour, linewidth=3)[0] for colour in palette.JOINTS]
    figure.legend(handles, [role.replace("_", " ") for role in ROLES], loc="outside lower center", ncols=6)
    return figure


def _draw_body(axes: Axes, seen: Pictured, biped: Biped, across: int, depth: int) -> None:
    """Shells from the far ones to the near ones, then the joints' axes and the soles, seen along the depth axis."""
    chosen = np.arange(len(seen.triangles))[:: max(1, len(seen.triangles) // _MOST)]
    triangles = seen.triangles[chosen]
    if len(triangles):
        normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        shade = 0.55 + 0.45 * abs(normals @ _LIGHT)
        order = np.argsort(triangles[:, :, depth].mean(axis=1))
        colours = np.clip(np.outer(shade, to_rgb(_SHELL)), 0.0, 1.0)
        flat = triangles[:, :, [across, 2]]
        shells = PolyCollection(list(flat[order]), facecolors=colours[order], edgecolors="face", linewidths=0.2)
        shells.set_alpha(0.75)
        shells.set_rasterized(True)
        axes.add_collection(shells)
    length = 0.08 * biped.config.com_height
    for number, name in enumerate(biped.joint_names):
        joint = seen.plant.GetJointByName(name)
        pose = joint.frame_on_parent().CalcPoseInWorld(seen.context)
        axis, place = pose.rotation() @ joint.revolute_axis(), pose.translation()
        ends = np.array([place - length * axis, place + length * axis])
        axes.plot(ends[:, across], ends[:, 2], color=palette.JOINTS[number % 6], linewidth=2.2, zorder=4)
        axes.plot(place[across], place[2], "o", color=palette.JOINTS[number % 6], markersize=4, zorder=5)
    for side in SIDES:
        corners = _corners(seen, biped, side)
        axes.plot(corners[:, across], corners[:, 2], color=_SOLE, linewidth=3, zorder=5, solid_capstyle="butt")
        if across == 1:
            spot = corners[:4].mean(axis=0)
            axes.annotate(side, (spot[1], spot[2]), (0, -6), textcoords="offset points", ha="center", va="top")
    axes.autoscale_view()


def _draw_soles(axes: Axes, seen: Pictured, biped: Biped) -> None:
    """Soles and what is drawn of the feet, from above, x ahead upwards."""
    for side in SIDES:
        body = biped.soles[side].frame.body().name()
        welded = {other.name() for other in seen.plant.GetBodiesWeldedTo(seen.plant.GetBodyByName(body))}
        own = [number for number, name in enumerate(seen.bodies) if name in welded]
        points = seen.triangles[own].reshape(-1, 3)
        axes.plot(-points[:, 1], points[:, 0], ".", color=_SHELL, markersize=1.0, rasterized=True)
        corners = _corners(seen, biped, side)
        outline = np.column_stack([-corners[:, 1], corners[:, 0]])
        sole = Polygon(outline, fill=False, edgecolor=_SOLE, linewidth=2.2, label=f"{side} sole", zorder=5)
        sole.set_linestyle((0.0, _DASHES[side]))
        axes.add_patch(sole)
        number = 6 * SIDES.index(side) + ROLES.index("ankle_pitch")
        ankle = seen.plant.GetJointByName(biped.joint_names[number]).frame_on_parent()
        place = ankle.CalcPoseInWorld(seen.context).translation()
        axes.plot(-place[1], place[0], "+", color=palette.MEASURED_COM, markersize=9)
    axes.plot([], [], "+", color=palette.MEASURED_COM, label="ankle")
    axes.set_title("soles from above")
    axes.set_xlabel("−y, to the right [m]")
    axes.set_ylabel("x, ahead [m]")
    axes.set_aspect("equal")
    axes.margins(0.15)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.25), ncols=1)


def _corners(seen: Pictured, biped: Biped, side: str) -> np.ndarray:
    """The closed outline of a sole in the world (5, 3) [m]."""
    pose = seen.plant.GetFrameByName(f"{side}_sole_centre").CalcPoseInWorld(seen.context)
    signs = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1], [1, 1]])
    half = biped.soles["left" if side == "left" else "right"].half_size
    return np.asarray((pose @ np.column_stack([signs * half, np.zeros(5)]).T).T)
