"""The one table of the blocks' vector ports: name, block, size, unit, meaning, elements, and whether it is logged.

Blocks take the sizes of their ports from it; so do logs, axis labels, the tests of ports and the table in
docs/run_folder.md.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

from pdhocbf_drake.robot.config import SIDES
from pdhocbf_drake.robot.per_joint import ROLES
from pdhocbf_drake.walking.course import SIZE


class Signal(NamedTuple):
    """A vector port. Input ports have the name and size of the output port that they are connected to.

    Attributes:
        name: of the port; blocks that are Drake's own (plant, encoders, sensors) have names of theirs.
        system: the block with that output port; the template and the oscillator's filter have some of them, too.
        size: number of elements, or a formula of what the scenario decides: the number of barriers n_b, the horizon
            H [ticks], and the number of constraints n_c that a plan may miss on an axis.
        unit, meaning: of the elements, in their order.
        elements: a name for each element; empty where they have none.
        logged: whether a run's log holds it, one row for each tick.
    """

    name: str
    system: str
    size: int | str
    unit: str
    meaning: str
    elements: tuple[str, ...]
    logged: bool


JOINTS: Final = tuple(f"{side}_{role}" for side in SIDES for role in ROLES)
"""The order of all vectors with one element for each joint."""

_STATE = tuple(f"{joint}_{kind}" for kind in "qv" for joint in JOINTS)
_TILT = tuple(derivative + angle for angle in ("roll", "pitch") for derivative in ("", "v", "a"))
_FORMULAS: Final[dict[str, Callable[[int, int, int], int]]] = {
    "n_b": lambda barriers, horizon, constraints: barriers,
    "n_b*(H+1)": lambda barriers, horizon, constraints: barriers * (horizon + 1),
    "2*H": lambda barriers, horizon, constraints: 2 * horizon,
    "2*n_c": lambda barriers, horizon, constraints: 2 * constraints,
}


def _signal(
    name: str, system: str, elements: str | tuple[str, ...] | int, unit: str, meaning: str, logged: bool = True
) -> Signal:
    """A row of the table, from the elements' names (in one text, apart by spaces), their number, or its formula."""
    if isinstance(elements, int) or elements in _FORMULAS:
        return Signal(name, system, elements, unit, meaning, (), logged)
    names = tuple(elements.split()) if isinstance(elements, str) else elements
    return Signal(name, system, len(names), unit, meaning, names, logged)


SIGNALS: Final[tuple[Signal, ...]] = (
    _signal("gait_phase", "gait_reference", "tick step support", "1",
            "tick of the step, step index, support (+1 left, -1 right, 0 both)"),
    _signal("com_height", "gait_reference", "z vz az", "m, m/s, m/s²",
            "commanded CoM height (24) and its derivatives"),
    _signal("path", "path_reference", "x y yaw forward lateral turn walks", "m, rad, m/s, rad/s, 1",
            "of a walk that follows commands: middle between the feet and heading of this step as commanded, the "
            "velocity ahead and aside and the turn rate that were granted to it, 1 or for a stand 0"),
    _signal("command_asked", "path_reference", "forward lateral turn walks", "m/s, rad/s, 1",
            "of a walk that follows commands: that of this step before its limits, 1 or for a stand 0"),
    _signal("zmp_box", "mpc_controller", "x_min x_max y_min y_max", "m",
            "the box (27) that held for this tick's planned ZMP; in a walk that turns along the heading of the tick "
            "before, from the world's origin"),
    _signal("barrier_bound", "barrier_schedule", "n_b*(H+1)", "as h", "bound V̄ of each barrier over the horizon"),
    _signal("h", "barrier_schedule", "n_b", "that of the barrier", "each barrier on the measured state"),
    _signal("lip_state", "state_estimator", "x vx x_zmp y vy y_zmp", "m, m/s", "measured CoM and ZMP"),
    _signal("com_reference", "mpc_controller", "x vx ax y vy ay", "m, m/s, m/s²", "planned CoM for this tick"),
    _signal("zmp_reference", "mpc_controller", "x_zmp ux y_zmp uy", "m, m/s",
            "planned ZMP for this tick and the ZMP velocity that leads to it"),
    _signal("stance_plan", "mpc_controller", "x_last y_last x_now y_now x_next y_next x_after y_after", "m",
            "stance centres of the last, this and the next two steps"),
    _signal("foot_plan", "mpc_controller",
            tuple(f"{s}_{a}_{end}" for s in SIDES for end in ("start", "end") for a in "xy"), "m",
            "start and end of each foot in this step", logged=False),
    _signal("last_step", "mpc_controller", "step", "1",
            "the step with the last swing, after which the walk comes to a stand, else -1", logged=False),
    _signal("resumed", "mpc_controller", "tick side last", "1",
            "steps in place of a stand: the tick from which on a foot swings, the stance foot of that step (+1 left, "
            "-1 right), the last such step; -1, 0, -1 without", logged=False),
    _signal("course", "mpc_controller", SIZE, "m, rad, m/s, rad/s, 1",
            "of a walk that follows commands: how far it has come under those of an input port, else -1 and zeros",
            logged=False),
    _signal("solver_status", "mpc_controller", "status time cost slack fallbacks reason", "1, s, 1, as h, 1, 1",
            "status (1 solved), wall time, cost, barrier slack, fallbacks in a row, reason code (mpc.plan.Reason)"),
    _signal("barrier_slack", "mpc_controller", "n_b", "as h", "largest slack of each barrier that the plan paid for"),
    _signal("barrier_active", "mpc_controller", "n_b", "1",
            "1 where a row of the barrier is active, as the plan would be another without it, else 0"),
    _signal("unmet", "mpc_controller", "2*n_c", "m, m/s",
            "in x, then in y: by how much the plan misses each constraint that it could not meet: "
            "stability (or terminal set), ZMP box, step limits, and the ZMP velocity where it is bounded"),
    _signal("input_disturbance", "mpc_controller", "x y x_cancelled y_cancelled", "m/s²",
            "acceleration of the CoM that the template does not model, as estimated, and what of it is cancelled"),
    _signal("zmp_offset", "zmp_offset", "2*H", "m",
            "expected whole-body minus template ZMP at the ticks of the horizon, x then y", logged=False),
    _signal("oscillator_state", "oscillator", "x1 x2", "1, 1/s", "state of the Van der Pol oscillator"),
    _signal("oscillator_input", "tube_filter", "u", "1/s²", "input found at the last tick"),
    _signal("measured_state", "measurement", "x vx x_zmp y vy y_zmp", "m, m/s",
            "lip_state as the controller gets it, where that is late or noisy"),
    _signal("com_z", "state_estimator", "z vz", "m, m/s", "measured CoM height and its rate"),
    _signal("foot_state", "state_estimator",
            tuple(f"{s}_{e}" for s in SIDES for e in ("x", "y", "z", "roll", "pitch", "yaw")), "m, rad",
            "measured sole centres and roll, pitch, yaw"),
    _signal("ground_load", "state_estimator", "fz", "N",
            "vertical force of the ground on the robot; below 1 N there is no ZMP, and lip_state keeps the last one"),
    _signal("last_zmp", "last_zmp", "x_zmp y_zmp", "m",
            "the ZMP in lip_state at the tick before; 1e300 where there was none", logged=False),
    _signal("foot_load", "foot_loads", SIDES, "N", "vertical force of the ground on each foot"),
    _signal("foot_load_estimate", "sensed_loads", SIDES, "N", "foot_load as the sensors above the soles have it",
            logged=False),
    _signal("joint_state", "joint_encoders", _STATE, "rad, rad/s", "measured joint positions, then velocities"),
    _signal("foot_reference", "foot_reference",
            tuple(f"{s}_{d}{a}" for s in SIDES for d in ("", "v", "a") for a in "xyz"), "m, m/s, m/s²",
            "left, then right sole: position, velocity, acceleration"),
    _signal("ground_reference", "ground_reference",
            ("z", "vz", "az", "z_zmp", *(f"{s}_{e}" for s in SIDES for e in ("aloft", *_TILT))),
            "m, m/s, m/s², m, 1, rad, rad/s, rad/s²",
            "of a walk on uneven ground: height of the ground's line under the CoM and its derivatives, height of the "
            "ZMP; of the left, then the right sole: 1 while it is in the air, roll and pitch with their derivatives"),
    _signal("foot_target", "footing",
            tuple(f"{s}_{d}{a}" for s in SIDES for d in ("", "v", "a") for a in "xyz"), "m, m/s, m/s²",
            "foot_reference, moved to where the soles have met the ground"),
    _signal("ground_target", "footing",
            ("z", "vz", "az", "z_zmp", *(f"{s}_{e}" for s in SIDES for e in ("aloft", *_TILT))),
            "m, m/s, m/s², m, 1, rad, rad/s, rad/s²", 
            "ground_reference likewise; a foot that goes on down is in the air"),
    _signal("landing_delay", "footing", "ticks", "1",
            "ticks by which the stance foot has come to the ground late: the ZMP's box moves onto it that much later"),
    _signal("turn_reference", "turn_reference",
            tuple(f"{part}_{d}yaw" for part in (*SIDES, "torso") for d in ("", "v", "a")), "rad, rad/s, rad/s²",
            "of a walk that turns: left sole, right sole, torso: heading, its rate and acceleration"),
    _signal("desired_state", "inverse_kinematics", _STATE, "rad, rad/s",
            "joint targets for this tick, then their rates"),
    _signal("feedforward", "inverse_kinematics", JOINTS, "N m", "inverse-dynamics torque"),
    _signal("torque_bias", "torque_bias", JOINTS, "N m",
            "what is added to the feedforward, since the PD of a leg that stands has been found to add it on average"),
    _signal("sent_torque", "torque_bias", JOINTS, "N m", "feedforward with torque_bias, as the joints get it",
            logged=False),
    _signal("whole_body_zmp", "inverse_kinematics", "x_zmp y_zmp", "m", "ZMP of the planned motion of all links"),
    _signal("ik_status", "inverse_kinematics", "met error iterations", "1, m or rad, 1",
            "whether the target is met (1 or 0), greatest task error, iterations", logged=False),
    _signal("whole_body", "inverse_kinematics", "reason miss height torso swing", "1, 1, m, rad, m",
            "of a walk with a whole-body program: reason code (whole_body.reason.Reason), the largest share of a limit "
            "by which one is missed, and how far height, torso and swing foot have given way"),
    _signal("plant_desired_state", "joint_targets", len(_STATE), "rad, rad/s",
            "joint targets and rates at this step of the plant, in the order of its actuators", logged=False),
    _signal("plant_actuation", "joint_targets", len(JOINTS), "N m",
            "inverse-dynamics torque, in the order of the plant's actuators", logged=False),
    _signal("actuation", "torque_sensors", JOINTS, "N m", "torque applied, within the effort limits"),
    _signal("push", "push_schedule", "fx fy fz", "N", "external force on the torso or the template"),
    _signal("robot_state", "plant", 13 + len(_STATE), "1, m, rad; m/s, rad/s",
            "positions (base quaternion wxyz, base xyz, joints) and velocities of the plant"),
    _signal("imu", "imu", "rate_x rate_y rate_z force_x force_y force_z last_x last_y last_z", "rad/s, m/s², rad/s",
            "mean rate and specific force over the last tick, in the floating link's axes at its start; the last "
            "sample's rate"),
    _signal("encoders", "encoder_rates", _STATE, "rad, rad/s", "angles as encoders give them, then their rates"),
    _signal("force_torque", "force_torque",
            tuple(f"{s}_{e}" for s in SIDES for e in ("mx", "my", "mz", "fx", "fy", "fz")), "N m, N",
            "moment and force of the ground about each sole's centre, in its axes, mean over the last tick"),
    _signal("lip_estimate", "base_estimator", "x vx x_zmp y vy y_zmp", "m, m/s",
            "CoM and ZMP as estimated from the sensors, counted from the stance foot"),
    _signal("com_z_estimate", "base_estimator", "z vz", "m, m/s", "likewise CoM height and its rate"),
    _signal("foot_estimate", "base_estimator",
            tuple(f"{s}_{e}" for s in SIDES for e in ("x", "y", "z", "roll", "pitch", "yaw")), "m, rad",
            "likewise sole centres and roll, pitch, yaw"),
    _signal("estimate_deviation", "base_estimator", "x y z vx vy vz", "m, m/s",
            "standard deviation of the CoM from the stance foot and of its velocity"),
    _signal("estimator_status", "base_estimator",
            "notice left_loaded right_loaded left_stands right_stands nis rows held", "1",
            "what is wrong with the sensors (estimation.Notice), feet with load and feet that stand still, squared "
            "innovations and their number, the foot that is held (0 left, 1 right)"),
    _signal("base_estimate", "base_estimator",
            tuple(f"r{i}{j}" for i in "123" for j in "123")
            + tuple(f"{part}_{a}" for part in ("v", "p", *SIDES, "gyro_bias", "accelerometer_bias") for a in "xyz"),
            "1, m/s, m, rad/s, m/s²",
            "the filter's own estimate: orientation, velocity and place of the floating link, soles, biases of "
            "gyroscope and accelerometer"),
    _signal("estimate_error", "estimate_errors", "tilt_x tilt_y vx vy vz x y z nees", "rad, m/s, m, 1",
            "of the floating link's tilt, velocity and place from the stance foot, and their normalized square"),
    _signal("contact_forces", "plant", 6 + len(JOINTS), "N m, N",
            "generalized contact forces of the ground on the robot, in the order of its velocities"),
)  # fmt: skip

LOGGED: Final = tuple(signal for signal in SIGNALS if signal.logged)
_BY_NAME: Final = {signal.name: signal for signal in SIGNALS}


def size(name: str, barriers: int = 0, horizon: int = 0, constraints: int = 0) -> int:
    """The number of elements of a port, where it depends on them for n_b barriers, a horizon H and n_c constraints."""
    given = _BY_NAME[name].size
    return given if isinstance(given, int) else _FORMULAS[given](barriers, horizon, constraints)


def sizes(*names: str, barriers: int = 0, horizon: int = 0, constraints: int = 0) -> dict[str, int]:
    """`size` of each port, in that order."""
    return {name: size(name, barriers, horizon, constraints) for name in names}


def places(name: str, *elements: str) -> list[int]:
    """Where the named elements stand in a port's vector."""
    return [_BY_NAME[name].elements.index(element) for element in elements]


def stretch(name: str, first: str, second: str) -> slice:
    """Two elements of a port's vector as a slice, with which numpy makes no copy and takes a fifth of the time."""
    start, stop = places(name, first, second)
    return slice(start, stop + 1, stop - start)
