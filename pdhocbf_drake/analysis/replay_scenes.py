"""The three scenes of a replay: the robot, the pendulum template, the oscillator."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pydrake.geometry import Box, Cylinder, MeshcatVisualizer, MeshcatVisualizerParams, Role, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.feet import sole_centres, step_starts, touchdown_rows
from pdhocbf_drake.analysis.heights import commanded_com_height
from pdhocbf_drake.analysis.replay_estimate import EstimateMarker
from pdhocbf_drake.analysis.replay_markers import Foothold, RecordedMarkers, colour_by_safety, safety_along
from pdhocbf_drake.analysis.replay_stage import Stage
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.robot.config import SIDES
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.walking import Gait

Draw = Callable[[int, float], None]
"""Draws a row of the log at a time of the recording [s]."""


def robot_scene(stage: Stage, run: Run) -> Draw:
    """The robot in its recorded posture, with all markers."""
    log, biped = run.log, Biped.load(run.scenario.robot)
    pose, count = posed_robot(stage, biped)
    positions = log["robot_state"][:, :count]
    taken = []
    for side in SIDES:
        centres, yaws = sole_centres(log, side), log.element("foot_state", f"{side}_yaw")
        for row in touchdown_rows(log, side):
            start = row - int(log.element("gait_phase", "tick")[row])
            yaw = float(yaws[row]) if "path" in log else 0.0
            taken.append(Foothold(max(0, start), side, centres[row], biped.soles[side].half_size, yaw))
    markers = RecordedMarkers(stage, run, log.element("com_z", "z"), taken)
    estimate = EstimateMarker(stage, log) if "lip_estimate" in log else None

    def draw(row: int, time: float) -> None:
        pose(positions[row], time)
        markers.draw(row)
        if estimate is not None:
            estimate.draw(row)

    return draw


def posed_robot(stage: Stage, biped: Biped) -> tuple[Callable[[np.ndarray, float], None], int]:
    """The robot on a stage: what draws it in a posture q at a time [s], and the size of q."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    biped.add_to(plant)
    plant.Finalize()
    params = MeshcatVisualizerParams(
        role=Role.kIllustration, prefix=f"{stage.world}/robot", delete_on_initialization_event=False
    )
    visualizer = MeshcatVisualizer.AddToBuilder(builder, scene_graph, stage.meshcat, params)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()

    def pose(positions: np.ndarray, time: float) -> None:
        context.SetTime(time)
        plant.SetPositions(plant.GetMyMutableContextFromRoot(context), positions)
        visualizer.ForcedPublish(visualizer.GetMyContextFromRoot(context))

    return pose, plant.num_positions()


def template_scene(stage: Stage, run: Run) -> Draw:
    """The variable-height pendulum: a point mass on a telescopic leg from the ZMP."""
    log, gait = run.log, Gait(run.scenario.gait)
    box = gait.region.half(gait.support(gait.config.start_steps))
    starts, support = step_starts(log), log.element("gait_phase", "support")
    taken = [
        Foothold(
            row,
            "left" if support[row] > 0 else "right",
            log["stance_plan"][row, 2:4],
            box,
            float(log.element("path", "yaw")[row]) if "path" in log else 0.0,
        )
        for row in starts
        if support[row] != 0
    ]
    height = commanded_com_height(log)
    markers = RecordedMarkers(stage, run, height, taken)
    place = pendulum(stage, 0.8 * float(height.min()))

    def draw(row: int, _: float) -> None:
        place(log["lip_state"][row], float(height[row]))
        markers.draw(row)

    return draw


def pendulum(stage: Stage, length: float) -> Callable[[np.ndarray, float], None]:
    """The pendulum on a stage, as two tubes of a length [m]: what draws it at a `lip_state` and a height [m]."""
    stage.add("pendulum/tube", Cylinder(0.014, length), palette.LIMIT)
    stage.add("pendulum/rod", Cylinder(0.009, length), palette.LIMIT)

    def place(state: np.ndarray, height: float) -> None:
        x, _, x_zmp, y, _, y_zmp = state
        foot, mass = np.array([x_zmp, y_zmp, 0.0]), np.array([x, y, height])
        along = (mass - foot) / np.linalg.norm(mass - foot)
        turn = RotationMatrix.MakeFromOneVector(along, 2)
        stage.place("pendulum/tube", RigidTransform(turn, foot + along * length / 2))
        stage.place("pendulum/rod", RigidTransform(turn, mass - along * length / 2))

    return place


def oscillator_scene(stage: Stage, run: Run) -> Draw:
    """The phase plane on the ground, x₁ along x and x₂ along y, one metre a unit; the tube is a moving rectangle."""
    log = run.log
    state, h = log["oscillator_state"], log["h"]
    stage.add("tube", Box(1.0, 1.0, 0.002), palette.BARRIERS[0], 0.35)
    stage.add("state", Sphere(0.03), palette.MEASURED_COM)
    stage.add_trace("trace", np.column_stack([state, np.full(len(state), 0.004)]))
    safety = safety_along(run)
    stage.ground(-1.0, 1.0)
    stage.aim([0.0, 0.0, 0.0], [0.01, -1.6, 2.6])

    def draw(row: int, _: float) -> None:
        x1, x2 = state[row]
        upper_1, lower_1, upper_2, lower_2 = h[row]
        stage.move("state", [x1, x2, 0.03])
        stage.move("tube", [x1 + (upper_1 - lower_1) / 2, x2 + (upper_2 - lower_2) / 2, 0.002])
        stage.scale("tube", [round(upper_1 + lower_1, 4), round(upper_2 + lower_2, 4), 1.0])
        colour_by_safety(stage, "state", None if safety is None else float(safety[row]))

    return draw


def rows_of(log: RunLog, frames_per_second: float) -> list[tuple[int, float]]:
    """(row, time of the recording) of each frame."""
    tick = log.time[1] - log.time[0]
    count = int((log.time[-1] - log.time[0]) * frames_per_second + 1e-9) + 1
    return [(min(len(log) - 1, round(f / frames_per_second / tick)), f / frames_per_second) for f in range(count)]
