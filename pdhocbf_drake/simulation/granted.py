"""What a steady walk asks of joints and ground beyond what they have, and the longest stride at which it does not."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.errors import PdhocbfError
from pdhocbf_drake.fitting.steady_motion import OutOfReach, SteadyMotion, steady_motion
from pdhocbf_drake.mpc.programs import ProgramCache
from pdhocbf_drake.robot import ROLES, SIDES, Biped, sole_pose, upright_posture
from pdhocbf_drake.robot.grip import Grip
from pdhocbf_drake.simulation.build import nominal_mpc
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.systems.torso_yaw import TorsoYaw
from pdhocbf_drake.walking.com_height import GRAVITY

_HALVINGS = 5  # of the stride
_GRIP = 0.9  # share of the friction that a walk may use
_GIVES_WAY = 0.27  # by how much the peak of one kind of joint may exceed its limit where the whole-body program helps
_YAW = 10.0  # how far the torso may turn where it gives way, over the friction that is left [rad]
_GAITS = 4  # in which the torso's yaw settles


@dataclass(frozen=True)
class Asked:
    """A robot's walk at any stride.

    Attributes:
        biped: the robot. scenario: with `mpc.limits` as numbers. programs: of its plans.
        turn: the largest turn rate that is commanded [rad/s].
        motions: what `steady` has found, by stride.
    """

    biped: Biped
    scenario: Scenario
    programs: ProgramCache
    turn: float = 0.0
    motions: dict[float, SteadyMotion | str] = field(default_factory=dict)

    def changed(self, scenario: Scenario) -> Asked:
        """The same of another scenario."""
        return replace(self, scenario=scenario, motions={})

    def steady(self, stride: float) -> SteadyMotion | str:
        """The steady motion straight ahead, or why there is none."""
        if stride not in self.motions:
            self.motions[stride] = self._steady(stride)
        return self.motions[stride]

    def _steady(self, stride: float) -> SteadyMotion | str:
        try:
            motion = steady_motion(self.biped, nominal_mpc(self.scenario, stride, self.programs))
        except PdhocbfError as error:
            return _of_ankles(self.biped, self.scenario) or str(error)
        return motion.reason if isinstance(motion, OutOfReach) else motion


class Excess(NamedTuple):
    """What is exceeded, in words, empty if nothing is; whether it is the grip on the ground; the motion, if planned."""

    said: str = ""
    of_ground: bool = False
    motion: SteadyMotion | None = None


def longest_granted(asked: Asked, stride: float) -> float | None:
    """The longest stride up to the given one at which nothing is exceeded [m]; None if there is none."""
    if exceeded(asked, 0.0).said:
        return None
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if exceeded(asked, middle * stride).said else (middle, high)
    return round(low * stride, 4)


class Largest(NamedTuple):
    """The largest share of a joint's torque, infinite where a walk can't be walked; that in words, and the role."""

    share: float
    said: str
    role: str = ""


def largest_torque(asked: Asked, stride: float) -> Largest:
    """The largest share of a joint's torque in the steady walk straight ahead at a stride [m]."""
    motion = asked.steady(stride)
    if isinstance(motion, str):
        return Largest(math.inf, motion)
    peaks, limits = np.abs(motion.torques).max(axis=0), asked.biped.effort_limits
    joint = int((peaks / limits).argmax())
    said, role = _needs(asked.biped, joint, peaks, limits, "N m"), ROLES[joint % len(ROLES)]
    return Largest(float(peaks[joint] / limits[joint]), said, role)


def exceeded(asked: Asked, stride: float) -> Excess:
    """What a steady walk straight ahead at a stride [m] asks of a joint, or of the ground, beyond its limit."""
    biped, scenario, motion = asked.biped, asked.scenario, asked.steady(stride)
    if isinstance(motion, str):
        return Excess(motion)
    asks = [
        (np.abs(values).max(axis=0), limits, unit)
        for values, limits, unit in (
            (motion.torques, biped.effort_limits, "N m"), (motion.speeds, biped.velocity_limits, "rad/s")
        )
    ]  # fmt: skip
    missing = np.concatenate([(peaks / limits - 1.0).reshape(2, -1).max(axis=0) for peaks, limits, _ in asks]).clip(0.0)
    if missing.any() and not _gives_way(scenario, missing):
        peaks, limits, unit = max(asks, key=lambda ask: float((ask[0] / ask[1]).max()))
        return Excess(_needs(biped, int((peaks / limits).argmax()), peaks, limits, unit))
    # In a turn the ground also gives the centripetal force.
    duration = scenario.gait.ticks_per_step * scenario.gait.tick
    return _of_grip(biped, scenario, motion, abs(stride) / duration * asked.turn / GRAVITY)._replace(motion=motion)


def _gives_way(scenario: Scenario, missing: np.ndarray) -> bool:
    """Whether the whole-body program can do without what kinds of joints are short of, as shares of limits (n,).

    One kind may be short of `_GIVES_WAY`, and several of a part of that together, since one way to give way serves one.
    """
    allowed = _GIVES_WAY / np.count_nonzero(missing)
    return scenario.whole_body.kind != "closed_form" and bool(missing.sum() <= allowed)


def _needs(biped: Biped, joint: int, peaks: np.ndarray, limits: np.ndarray, unit: str) -> str:
    need, has = peaks[joint], limits[joint]
    return (
        f"{biped.joint_names[joint]} needs {need:.3g} {unit} and has {has:.3g} {unit}, "
        f"{need - has:.2g} {unit} are missing"
    )


def grip_of(biped: Biped, scenario: Scenario) -> Grip:
    """The grip of a scenario's robot, as it stands at the walk's height and width."""
    gait, half = scenario.gait, scenario.gait.stance_width / 2.0
    com = np.array([0.0, 0.0, gait.com_height])
    q = upright_posture(biped, com, sole_pose(0.0, half), sole_pose(0.0, -half))
    return Grip.of(biped, q, scenario.believed_friction, gait.zmp_box)


def _of_grip(biped: Biped, scenario: Scenario, motion: SteadyMotion, more: float) -> Excess:
    """What is asked of friction; `more` than by the motion straight ahead is asked of |F_xy|/F_z [1]."""
    friction, used = scenario.believed_friction, float(motion.friction.max()) + more
    if used > _GRIP * friction:
        return Excess(f"the soles need a friction of {used:.2g}, and {_GRIP:g} of {friction:.2g} is there", True)
    grip = grip_of(biped, scenario)
    yaw, largest = TorsoYaw(), 0.0
    for _ in range(_GAITS):
        for share, moment in zip(motion.friction.tolist(), motion.yaw_moment.tolist(), strict=True):
            planned = yaw.returning
            turning = yaw.yielding(grip, planned, share + more, moment + grip.lever * planned)
            yaw = yaw.after(turning, scenario.gait.tick)
            largest = max(largest, abs(yaw.angle))
    if largest > (most := _YAW * (friction - used)):
        degrees = np.degrees([largest, most])
        return Excess(
            f"for a friction of {friction:.2g} the torso turns by {degrees[0]:.0f} degrees, and {degrees[1]:.0f} are "
            "allowed",
            True,
        )
    return Excess()


def _of_ankles(biped: Biped, scenario: Scenario) -> str:
    """Which ankle joints leave the ZMP too little of the soles for a walk that can't be planned, if any do."""
    limits, half = scenario.mpc.plan_limits, np.array(scenario.gait.zmp_box) / 2.0
    assert limits is not None
    soles = np.min([biped.soles[side].half_size for side in SIDES], axis=0)
    for role, low, high, edge, end in (
        ("ankle_pitch", limits.zmp_behind, limits.zmp_ahead, half[0], soles[0]),
        ("ankle_roll", limits.zmp_inward, limits.zmp_outward, half[1], soles[1]),
    ):
        if min(low, high) < edge:
            has = biped.effort_limits.reshape(2, -1)[:, ROLES.index(role)].min()
            return (
                f"{role} has {has:.3g} N m, which leaves the ZMP only from {-1e3 * min(low, end):.0f} to "
                f"{1e3 * min(high, end):.0f} mm of the soles' centres, too little to plan it"
            )
    return ""
