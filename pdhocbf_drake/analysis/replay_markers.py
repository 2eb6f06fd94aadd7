"""Markers of a walk's replay: CoM, ZMP and its box, planned and taken footholds; and the colour of safety."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from pydrake.geometry import Box, Cylinder, Sphere
from pydrake.math import RigidTransform, RotationMatrix

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.heading import box_frame
from pdhocbf_drake.analysis.replay_stage import Stage
from pdhocbf_drake.analysis.replay_view import view_of
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


_DRAWN = ("lip_state", "com_reference", "com_height", "zmp_reference", "zmp_box", "stance_plan")


class Markers:
    """CoM, ZMP, ZMP box and footholds of a walk, on the ground, under a view that follows the walk.

    Args:
        com_z: height of the measured CoM at each row, (T,) [m].
        taken: the footholds.
    """

    def __init__(self, stage: Stage, run: Run, com_z: np.ndarray, taken: list[Foothold]) -> None:
        self._stage, self._com_z = stage, com_z
        self._log = {name: run.log[name] for name in _DRAWN}
        self._safety = safety_along(run)
        stage.add("CoM measured", Sphere(0.035), palette.MEASURED_COM)
        stage.add("CoM planned", Sphere(0.05), palette.PLANNED_COM, 0.35)
        stage.add("CoM plumb line", Cylinder(0.003, 1.0), palette.LIMIT, 0.6)
        stage.add("ZMP measured", Cylinder(0.012, 0.004), palette.MEASURED_ZMP)
        stage.add("ZMP planned", Cylinder(0.020, 0.004), palette.PLANNED_ZMP)
        stage.add("ZMP box", Box(1.0, 1.0, 0.002), palette.BARRIERS[0], 0.35)
        # From far to near: the body hides none of them, nor do they hide each other.
        for order, path in enumerate(("ZMP box", "ZMP planned", "ZMP measured", "CoM measured")):
            stage.through_everything(path, order)
        colours = {"left": palette.LEFT, "right": palette.RIGHT}
        for number, foothold in enumerate(taken):
            path = _taken_path(number)
            stage.add(path, Box(2 * foothold.half[0], 2 * foothold.half[1], 0.001), colours[foothold.side], 0.35)
            stage.place(path, _lying([*foothold.centre, _FOOTHOLD], foothold.yaw))
        # Those that are not taken yet, the next one last.
        self._hidden = sorted(((foothold.row, number) for number, foothold in enumerate(taken)), reverse=True)
        self._drawn = False
        half = taken[0].half if taken else np.array([0.05, 0.05])
        for path in ("footholds planned/next", "footholds planned/after"):
            _outline(stage, path, half)
        x, y = run.log.element("lip_state", "x"), run.log.element("lip_state", "y")
        self._yaws = _headings(run)
        aside = (float(y.min()), float(y.max())) if "path" in run.log else (0.0, 0.0)
        stage.ground(float(x.min()), float(x.max()), *aside)
        stage.aim([0.05, 0.0, 0.45], [0.85, -1.3, 0.4])
        self._view = view_of(run)

    def draw(self, row: int) -> None:
        """Places the markers as at that row of the log; rows must not decrease from call to call."""
        stage, log = self._stage, self._log
        x, _, x_zmp, y, _, y_zmp = log["lip_state"][row]
        z = self._com_z[row]
        stage.move("CoM measured", [x, y, z])
        stage.move("CoM plumb line", [x, y, z / 2])
        stage.scale("CoM plumb line", [1.0, 1.0, z])
        stage.move("CoM planned", [*log["com_reference"][row, [0, 3]], log["com_height"][row, 0]])
        stage.move("ZMP measured", [x_zmp, y_zmp, _MEASURED])
        stage.move("ZMP planned", [*log["zmp_reference"][row, [0, 2]], _PLANNED])
        x_min, x_max, y_min, y_max = log["zmp_box"][row]
        box, coming, after = self._yaws[row]
        c, s, ahead, aside = np.cos(box), np.sin(box), (x_min + x_max) / 2, (y_min + y_max) / 2
        stage.place("ZMP box", _lying([c * ahead - s * aside, s * ahead + c * aside, _BOX], box))
        stage.scale("ZMP box", [round(x_max - x_min, 4), round(y_max - y_min, 4), 1.0])
        plan = log["stance_plan"][row].reshape(4, 2)
        stage.place("footholds planned/next", _lying([*plan[2], _OUTLINE], coming))
        stage.place("footholds planned/after", _lying([*plan[3], _OUTLINE], after))
        if not self._drawn:
            for _, number in self._hidden:
                stage.show(_taken_path(number), False)
            self._drawn = True
        while self._hidden and self._hidden[-1][0] <= row:
            stage.show(_taken_path(self._hidden.pop()[1]), True)
        colour_by_safety(stage, "CoM measured", self._safety, row)
        x_seen, y_seen, yaw = self._view[row]
        stage.follow([x_seen, y_seen, 0.0], yaw)


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


def colour_by_safety(stage: Stage, path: str, safety: np.ndarray | None, row: int) -> None:
    """Colours the shape at a path, if there is a barrier; in few shades, since each change of colour is recorded."""
    if safety is not None:
        stage.colour(path, palette.safety_colour(round(12 * safety[row]) / 12, 1.0))


def safety_along(run: Run) -> np.ndarray | None:
    """Least h of the barriers at each row, over its median in the steady state, limited to [0, 1], (T,).

    None without a barrier.
    """
    if "h" not in run.log:
        return None
    h, first = run.log["h"], round(run.scenario.from_time / run.scenario.tick)
    usual = np.maximum(np.median(h[first:] if len(h) > first else h, axis=0), 1e-6)
    return np.nan_to_num(np.clip((h / usual).min(axis=1), 0.0, 1.0))


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
