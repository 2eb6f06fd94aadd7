"""The one table of every logged signal: system, port, size, unit, meaning.

Loggers, log columns, axis labels, port tests and the README's table come from it.
"""

from __future__ import annotations

from typing import NamedTuple

from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.terms import constraints_of


class Signal(NamedTuple):
    """One vector port that is logged at every tick.

    `size` may name a number that the scenario decides: "n_b" barriers, "n_b*(H+1)" bound samples.
    `elements` names each entry where the size is fixed.
    """

    name: str
    system: str
    size: int | str
    unit: str
    meaning: str
    elements: tuple[str, ...] = ()
    only: str = ""  # "robot" or "oscillator" where nothing else has such a port


JOINTS = tuple(
    f"{side}_{joint}"
    for side in ("left", "right")
    for joint in ("hip_yaw", "hip_roll", "hip_pitch", "knee_pitch", "ankle_pitch", "ankle_roll")
)

SIGNALS: tuple[Signal, ...] = (
    Signal(
        "gait_phase",
        "gait_reference",
        3,
        "1",
        "tick of the step, step index, support (+1 left, -1 right, 0 both)",
        ("tick", "step", "support"),
    ),
    Signal(
        "com_height",
        "gait_reference",
        3,
        "m, m/s, m/s²",
        "commanded CoM height (24) and its derivatives",
        ("z", "vz", "az"),
    ),
    Signal(
        "zmp_box",
        "mpc_controller",
        4,
        "m",
        "the box (27) that held for this tick's planned ZMP",
        ("x_min", "x_max", "y_min", "y_max"),
    ),
    Signal("velocity_bound", "barrier_schedule", "n_b*(H+1)", "m/s", "bound of each barrier over the horizon"),
    Signal("h", "barrier_schedule", "n_b", "m/s", "each barrier on the measured state"),
    Signal(
        "lip_state", "state_estimator", 6, "m, m/s", "measured CoM and ZMP", ("x", "vx", "x_zmp", "y", "vy", "y_zmp")
    ),
    Signal(
        "com_reference",
        "mpc_controller",
        6,
        "m, m/s, m/s²",
        "planned CoM for this tick",
        ("x", "vx", "ax", "y", "vy", "ay"),
    ),
    Signal(
        "zmp_reference",
        "mpc_controller",
        4,
        "m, m/s",
        "planned ZMP for this tick and the ZMP velocity that leads to it",
        ("x_zmp", "ux", "y_zmp", "uy"),
    ),
    Signal(
        "stance_plan",
        "mpc_controller",
        8,
        "m",
        "stance centres of the last, this and the next two steps",
        ("x_last", "y_last", "x_now", "y_now", "x_next", "y_next", "x_after", "y_after"),
    ),
    Signal(
        "solver_status",
        "mpc_controller",
        6,
        "1, s, 1, m/s, 1, 1",
        "status (1 solved), wall time, cost, barrier slack, fallbacks in a row, reason code (mpc.solution.Reason)",
        ("status", "time", "cost", "slack", "fallbacks", "reason"),
    ),
    Signal("barrier_slack", "mpc_controller", "n_b", "as h", "largest slack of each barrier that the plan paid for"),
    Signal(
        "unmet",
        "mpc_controller",
        6,
        "m",
        "by how much the plan misses what its axis could not meet: stability (or terminal set), ZMP box, step limits",
        tuple(f"{constraint}_{axis}" for axis in "xy" for constraint in constraints_of(MpcConfig())),
    ),
    Signal(
        "oscillator_state", "oscillator", 2, "1, 1/s", "state of the Van der Pol oscillator", ("x1", "x2"), "oscillator"
    ),
    Signal("oscillator_input", "tube_filter", 1, "1/s²", "input found at the last tick", ("u",), "oscillator"),
    Signal("com_z", "state_estimator", 2, "m, m/s", "measured CoM height and its rate", ("z", "vz"), "robot"),
    Signal(
        "foot_state",
        "state_estimator",
        12,
        "m, rad",
        "measured sole centres and roll, pitch, yaw",
        tuple(f"{s}_{e}" for s in ("left", "right") for e in ("x", "y", "z", "roll", "pitch", "yaw")),
        "robot",
    ),
    Signal(
        "joint_state",
        "joint_encoders",
        24,
        "rad, rad/s",
        "measured joint positions, then velocities",
        tuple(f"{j}_{q}" for q in ("q", "v") for j in JOINTS),
        "robot",
    ),
    Signal(
        "foot_reference",
        "foot_reference",
        18,
        "m, m/s, m/s²",
        "left, then right sole: position, velocity, acceleration",
        tuple(f"{s}_{d}{a}" for s in ("left", "right") for d in ("", "v", "a") for a in "xyz"),
        "robot",
    ),
    Signal(
        "desired_state",
        "inverse_kinematics",
        24,
        "rad, rad/s",
        "joint targets for this tick, then their rates",
        tuple(f"{j}_{q}" for q in ("q", "v") for j in JOINTS),
        "robot",
    ),
    Signal("feedforward", "inverse_kinematics", 12, "N m", "inverse-dynamics torque", JOINTS, "robot"),
    Signal("actuation", "torque_sensors", 12, "N m", "torque applied, within the effort limits", JOINTS, "robot"),
    Signal("push", "push_schedule", 3, "N", "external force on the torso or the template", ("fx", "fy", "fz")),
    Signal(
        "robot_state",
        "plant",
        37,
        "1, m, rad; m/s, rad/s",
        "positions (base quaternion wxyz, base xyz, joints) and velocities of the plant",
        (),
        "robot",
    ),
)
