"""Fig. 5: the recorded walk rendered over one gait, pose by pose, from the side and obliquely; and its replay."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from pydrake.geometry import (
    Box,
    ClippingRange,
    ColorRenderCamera,
    LightParameter,
    MakeRenderEngineVtk,
    RenderCameraCore,
    RenderEngineVtkParams,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo

from pdhocbf_drake.analysis.replay import replay_html
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.studies.reproduce.report import Picture, Section
from pdhocbf_drake.studies.reproduce.runs import Runs
from pdhocbf_drake.studies.reproduce.walk import ROBOT
from pdhocbf_drake.studies.shared.cases import PERIODIC

_SETTLED, _POSES = 3, 4  # gaits before the one that is shown, pictures of it
_SIZE = (480, 900)  # of the picture of a pose
_VIEWS = {"side": (0.0, -2.6, 0.15), "oblique": (1.8, -1.75, 0.6)}  # camera, from the CoM of a pose [m]
_FADED = 0.25  # what is left of the floor's grey
_ALONG_X = np.eye(37)[4]  # of the base, in the positions and velocities of a pose
Pixels = NDArray[np.float64]


def figure_5(runs: Runs) -> Section:
    """Five poses of one gait in two views, and the replay of the run."""
    run = runs.run(ROBOT[PERIODIC])
    runs.report("rendering the snapshots")
    gait = run.scenario.gait
    first = gait.start_steps * gait.ticks_per_step + _SETTLED * gait.ticks_per_gait
    rows = first + gait.ticks_per_gait * np.arange(_POSES + 1) // _POSES
    poses = run.log["robot_state"][rows]
    studio = Studio(run.scenario.robot, gait.com_height)
    figure = Figure(figsize=(8.5, 7.0))
    panels = figure.subplots(len(_VIEWS), len(rows), gridspec_kw={"wspace": 0.02, "hspace": 0.02})
    for row, view in enumerate(_VIEWS):
        for axes, pose, time in zip(panels[row], poses, run.log.time[rows], strict=True):
            axes.imshow(studio.photo(pose, view))
            axes.axis("off")
            if row == 0:
                axes.set_title(f"{time:.1f} s")
    data = {"time [s]": run.log.time[rows]}
    data |= {f"CoM {axis} [m]": run.log.element("lip_state", axis)[rows] for axis in "xy"}
    data |= {f"position {i}": poses[:, i] for i in range(19)}
    every = gait.tick * gait.ticks_per_gait / _POSES
    caption = f"Fig. 5: one gait of the recorded walk, a pose every {every:g} s, from the side and obliquely."
    return Section(
        "Fig. 5: snapshots of the walk",
        ["Rendered by Drake from the recorded joint angles. The replay of the whole run is below."],
        [Picture("fig5", caption, figure, data)],
        finding="The rendered feet, knees and torso are those of the log.",
        frames={"Replay of the robot under Case 2": replay_html(run)},
    )


class Studio:
    """The robot on a plain floor, and a camera directed at a height [m] over the place of its base."""

    def __init__(self, robot: str, height: float) -> None:
        builder = DiagramBuilder()
        self._plant, self._scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        Biped.load(robot).add_to(self._plant)
        floor, grey = RigidTransform([0.0, 0.0, -0.01]), np.array([0.93, 0.93, 0.93, 1.0])
        self._plant.RegisterVisualGeometry(self._plant.world_body(), floor, Box(20.0, 20.0, 0.02), "floor", grey)
        self._plant.Finalize()
        lights = [
            LightParameter(type="directional", direction=[0.3, 0.4, 1.0], frame="camera", intensity=1.0),
            LightParameter(type="directional", direction=[0.2, 0.3, -1.0], frame="world", intensity=1.6),
        ]
        params = RenderEngineVtkParams(default_clear_color=[1.0, 1.0, 1.0], lights=lights)
        self._scene_graph.AddRenderer("vtk", MakeRenderEngineVtk(params))
        self._diagram = builder.Build()
        self._context = self._diagram.CreateDefaultContext()
        self._height = height
        core = RenderCameraCore("vtk", CameraInfo(*_SIZE, 0.62), ClippingRange(0.1, 30.0), RigidTransform())
        self._camera = ColorRenderCamera(core, False)

    def photo(self, pose: NDArray[np.float64], view: str) -> Pixels:
        """The robot in a pose, (height, width, 3) in [0, 1], on a floor that is faded towards white."""
        middle = np.array([pose[4], pose[5], self._height])
        robot, empty = self._render(pose, middle, view), self._render(pose + 100.0 * _ALONG_X, middle, view)
        there = np.abs(robot - empty).max(axis=2, keepdims=True) > 0.02
        return np.where(there, robot, 1.0 - _FADED * (1.0 - empty))

    def _render(self, pose: NDArray[np.float64], middle: NDArray[np.float64], view: str) -> Pixels:
        positions = pose[: self._plant.num_positions()]
        self._plant.SetPositions(self._plant.GetMyMutableContextFromRoot(self._context), positions)
        query = self._scene_graph.get_query_output_port().Eval(self._scene_graph.GetMyContextFromRoot(self._context))
        camera = camera_pose(middle + np.array(_VIEWS[view]), middle)
        image = query.RenderColorImage(self._camera, self._scene_graph.world_frame_id(), camera)
        return np.asarray(image.data[:, :, :3], dtype=float) / 255.0


def camera_pose(place: NDArray[np.float64], target: NDArray[np.float64]) -> RigidTransform:
    """The pose of an upright camera (z forward, y down) at `place` that is directed at `target`."""
    forward = (target - place) / np.linalg.norm(target - place)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return RigidTransform(RotationMatrix(np.column_stack([right, np.cross(forward, right), forward])), place)
