"""Markers of a walk's replay: CoM, ZMP and its box, planned and taken footholds; and the colour of safety."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake.geometry import Box, Cylinder, Sphere
from pydrake.math import RigidTransform, RotationMatrix

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.barrier_margins import barriers_of, h_along
from pdhocbf_drake.analysis.heading import box_frame
from pdhocbf_drake.analysis.heights import commanded_com_height
from pdhocbf_drake.analysis.replay_stage import Stage
from pdhocbf_drake.analysis.replay_view import view_of
from pdhocbf_drake.ground.terrain import Terrain
from pdhocbf_drake.simulation.run_folder import Run

# Heights above the ground that keep flat things from flickering through each other [m].
_FOOTHOLD, _OUTLINE, _BOX, _PLANNED, _MEASURED = 0.001, 0.003, 0.005, 0.008, 0.011


class Foothold(NamedTuple):
    """A sole on the ground: the row of the log from which it stands, side, centre and half size (2,) [m], heading."""

    row: int
    side: str
    centre: np.ndarray
    half: np.ndarray
    yaw: float = 0.0


class Frame(NamedTuple):
    """What the markers of one tick show; signals as in `systems.signals`.

    Attributes:
        lip_state, com_reference, zmp_reference, zmp_box, stance_plan: rows of these signals.
        com_z, com_height: height of the CoM, measured and commanded [m].
        headings: of the ZMP box and of the stance in the two coming steps (3,) [rad].
        view: place and heading that the view follows (3,) [m, rad].
        safety: from 0, no margin left, to 1, as safe as usual; None without a barrier.
    """

    lip_state: np.ndarray
    com_reference: np.ndarray
    zmp_reference: np.ndarray
    zmp_box: np.ndarray
    stance_plan: np.ndarray
    com_z: float
    com_height: float
    headings: np.ndarray
    view: np.ndarray
    safety: float | None


class Markers:
    """CoM, ZMP, ZMP box and planned footholds of a walk, on the ground, under a view that follows the walk.

    Args:
        half: half size of the planned footholds (2,) [m].
        terrain: the ground.
    """

    def __init__(self, stage: Stage, half: np.ndarray, terrain: Terrain) -> None:
        self._stage, self._terrain = stage, terrain
        stage.add("CoM measured", Sphere(0.035), palette.MEASURED_COM)
        stage.add("CoM planned", Sphere(0.05), palette.PLANNED_COM, 0.35)
        stage.add("CoM plumb line", Cylinder(0.003, 1.0), palette.LIMIT, 0.6)
        stage.add("ZMP measured", Cylinder(0.012, 0.004), palette.MEASURED_ZMP)
        stage.add("ZMP planned", Cylinder(0.020, 0.004), palette.PLANNED_ZMP)
        stage.add("ZMP box", Box(1.0, 1.0, 0.002), palette.BARRIERS[0], 0.35)
        # From far to near: the body hides none of them, nor do they hide each other.
        for order, path in enumerate(("ZMP box", "ZMP planned", "ZMP measured", "CoM measured")):
            stage.through_everything(path, order)
        for path in ("footholds planned/next", "footholds planned/after"):
            _outline(stage, path, half)
        stage.aim([0.05, 0.0, 0.45], [0.85, -1.3, 0.4])

    def draw(self, frame: Frame) -> None:
        """Places the markers."""
        stage, z = self._stage, frame.com_z
        x, _, x_zmp, y, _, y_zmp = frame.lip_state
        stage.move("CoM measured", [x, y, z])
        below = self._terrain.height(x, y, known=False)
        stage.move("CoM plumb line", [x, y, (z + below) / 2])
        stage.scale("CoM plumb line", [1.0, 1.0, z - below])
        stage.move("CoM planned", [*frame.com_reference[[0, 3]], frame.com_height])
        stage.move("ZMP measured", self._on_ground((x_zmp, y_zmp), _MEASURED))
        stage.move("ZMP planned", self._on_ground(frame.zmp_reference[[0, 2]], _PLANNED))
        x_min, x_max, y_min, y_max = frame.zmp_box
        box, coming, after = frame.headings
        c, s, ahead, aside = np.cos(box), np.sin(box), (x_min + x_max) / 2, (y_min + y_max) / 2
        stage.place("ZMP box", _lying(self._on_ground((c * ahead - s * aside, s * ahead + c * aside), _BOX), box))
        stage.scale("ZMP box", [round(x_max - x_min, 4), round(y_max - y_min, 4), 1.0])
        plan = frame.stance_plan.reshape(4, 2)
        stage.place("footholds planned/next", _lying(self._on_ground(plan[2], _OUTLINE), coming))
        stage.place("footholds planned/after", _lying(self._on_ground(plan[3], _OUTLINE), after))
        colour_by_safety(stage, "CoM measured", frame.safety)
        stage.follow([*frame.view[:2], 0.0], frame.view[2])

    def _on_ground(self, place: Sequence[float] | np.ndarray, over: float) -> list[float]:
        """A place so far over the ground [m]."""
        x, y = place
        return [x, y, self._terrain.height(x, y, known=False) + over]


class RecordedMarkers:
    """The markers of a run at each row of its log, and the footholds that it has taken until then.

    Args:
        com_z: height of the measured CoM at each row, (T,) [m].
        taken: the footholds.
    """

    def __init__(self, stage: Stage, run: Run, com_z: np.ndarray, taken: list[Foothold]) -> None:
        self._stage, self._com_z = stage, com_z
        terrain = run.scenario.terrain
        self._markers = Markers(stage, taken[0].half if taken else np.array([0.05, 0.05]), terrain)
        self._log = {name: run.log[name] for name in _DRAWN}
        self._com_height = commanded_com_height(run.log)
        self._safety, self._headings, self._view = safety_along(run), _headings(run), view_of(run)
        for number, foothold in enumerate(taken):
            add_foothold(stage, number, foothold, terrain)
        # Those that are not taken yet, the next one last.
        self._hidden = sorted(((foothold.row, number) for number, foothold in enumerate(taken)), reverse=True)
        self._drawn = False
        x, y = run.log.element("lip_state", "x"), run.log.element("lip_state", "y")
        aside = (float(y.min()), float(y.max())) if "path" in run.log else (0.0, 0.0)
        stage.ground(float(x.min()), float(x.max()), *aside, terrain)

    def draw(self, row: int) -> None:
        """Places the markers as at that row of the log; rows must not decrease from call to call."""
        if not self._drawn:
            for _, number in self._hidden:
                self._stage.show(_taken_path(number), False)
            self._drawn = True
        while self._hidden and self._hidden[-1][0] <= row:
            self._stage.show(_taken_path(self._hidden.pop()[1]), True)
        signals = {name: table[row] for name, table in self._log.items()}
        safety = None if self._safety is None else float(self._safety[row])
        height, com_height = float(self._com_z[row]), float(self._com_height[row])
        headings, view = self._headings[row], self._view[row]
        self._markers.draw(
            Frame(**signals, com_z=height, com_height=com_height, headings=headings, view=view, safety=safety)
        )


_DRAWN = ("lip_state", "com_reference", "zmp_reference", "zmp_box", "stance_plan")


def add_foothold(stage: Stage, number: int, foothold: Foothold, terrain: Terrain) -> None:
    """Lays a foothold that has been taken onto the ground."""
    colours = {"left": palette.LEFT, "right": palette.RIGHT}
    path = _taken_path(number)
    stage.add(path, Box(2 * foothold.half[0], 2 * foothold.half[1], 0.001), colours[foothold.side], 0.35)
    height = terrain.height(foothold.centre[0], foothold.centre[1], known=False)
    stage.place(path, _lying([*foothold.centre, height + _FOOTHOLD], foothold.yaw))


def _lying(place: list[float], yaw: float) -> RigidTransform:
    """The pose of what lies on the ground with a heading."""
    return RigidTransform(RotationMatrix.MakeZRotation(yaw), place)


def _headings(run: Run) -> np.ndarray:
    """Headings of the ZMP box and of the stance in the two coming steps at each row, (T, 3) [rad]."""
    log = run.log
    if "path" not in log:
        return np.zeros((len(log), 3))
    turn = log.element("path", "turn") * run.scenario.gait.ticks_per_step * run.scenario.tick
    here = log.element("path", "yaw")
    return np.column_stack([box_frame(log)[:, 2], here + turn, here + 2.0 * turn])


def colour_by_safety(stage: Stage, path: str, safety: float | None) -> None:
    """Colours the shape at a path, if there is a barrier; in few shades, since each change of colour is recorded."""
    if safety is not None:
        stage.colour(path, palette.safety_colour(round(12 * safety) / 12, 1.0))


def safety_along(run: Run) -> np.ndarray | None:
    """Least h of the barriers at each row, over its median in the steady state, limited to [0, 1], (T,).

    None without a barrier.
    """
    if "h" not in run.log:
        return None
    first, uses = round(run.scenario.from_time / run.scenario.tick), barriers_of(run.scenario).values()
    usual = [_usual(h_along(run.log, run.scenario, use), first) for use in uses]
    return np.nan_to_num(np.clip((run.log["h"] / usual).min(axis=1), 0.0, 1.0))


def _usual(h: np.ndarray, first: int) -> float:
    """The median of h from a row on, of the rows in which the barrier is kept."""
    settled = h[first:] if len(h) > first else h
    kept = settled[~np.isnan(settled)]
    return max(float(np.median(kept)), 1e-6) if len(kept) else 1.0


def _taken_path(number: int) -> str:
    return f"footholds taken/{number}"


def _outline(stage: Stage, path: str, half: np.ndarray) -> None:
    """A rectangle of four thin bars."""
    bar = 0.006
    for name, x, y, length, width in (
        ("front", half[0], 0.0, bar, 2 * half[1]),
        ("back", -half[0], 0.0, bar, 2 * half[1]),
        ("left", 0.0, half[1], 2 * half[0], bar),
        ("right", 0.0, -half[1], 2 * half[0], bar),
    ):
        stage.add(f"{path}/{name}", Box(length, width, 0.002), palette.LIMIT)
        stage.move(f"{path}/{name}", [x, y, 0.0])
