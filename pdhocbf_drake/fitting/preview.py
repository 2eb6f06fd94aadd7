"""One step of a steady walk without a simulation: what it asks of the joints, and how the swing leg moves the ZMP."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.robot import Biped, InverseDynamics, Posture, WholeBodyIk, sole_pose
from pdhocbf_drake.robot.posture import COM, LEFT, RIGHT
from pdhocbf_drake.walking.com_height import GRAVITY
from pdhocbf_drake.walking.config import GaitConfig
from pdhocbf_drake.walking.swing import swing_point

_SAMPLES = 16
_MIRRORED = 2e-3  # largest difference of the ZMP on one foot and the mirrored one on the other, over a leg's length
PEAK = 10.0 / math.sqrt(3.0)
"""Largest acceleration of a least-jerk motion by one unit of length in one unit of time, 10/√3 = 5.77."""


class Step(NamedTuple):
    """A step straight ahead.

    Attributes:
        stride: [m]. width: lateral distance of the feet [m]. height: of the CoM [m]. swing_height: of the foot [m].
        duration: of the step [s]. swing: of the foot's swing, at the step's end [s].
    """

    stride: float
    width: float
    height: float
    swing_height: float
    duration: float
    swing: float

    @classmethod
    def of(cls, gait: GaitConfig) -> Step:
        """The step of a gait."""
        swing = (gait.ticks_per_step - gait.double_support_ticks) * gait.tick
        duration = gait.ticks_per_step * gait.tick
        return cls(gait.stride, gait.stance_width, gait.com_height, gait.swing_height, duration, swing)


class Preview(NamedTuple):
    """What a step asks of the robot.

    Attributes:
        speeds: largest joint speeds over both steps of a gait, before they are limited (12,) [rad/s].
        torques: largest joint torques (12,) [N m].
        offsets: ZMP of all links less that of the pendulum, on the left and on the right foot (2, samples, 2) [m].
        missed: why a posture is out of reach, else empty.
    """

    speeds: np.ndarray
    torques: np.ndarray
    offsets: np.ndarray
    missed: str


def zmp_shift(lever: float, stride: float, swing: float) -> float:
    """How far the swing leg moves the ZMP at most [m]: lever · 5.77 · 2 stride/T_swing².

    Args:
        lever: along x, see `robot.swing_lever` [s²]. stride: [m]. swing: T_swing, the time of the foot's swing [s].
    """
    return abs(lever * PEAK * 2.0 * stride) / swing**2


def preview(biped: Biped, step: Step) -> Preview:
    """Joint speeds and torques of both steps of a gait, on the orbit of a pendulum of constant height.

    With the ZMP in the stance foot and ω² = g/z, τ = t − T/2 the time from mid-stance:

        x(t) = (stride/2) sinh(ωτ)/sinh(ωT/2),    y(t) = (width/2) (1 − cosh(ωτ)/cosh(ωT/2)) towards the stance foot.
    """
    ik = WholeBodyIk(biped)
    task = ik.task_space
    dynamics = InverseDynamics(biped, task)
    speeds, torques, offsets = np.zeros(12), np.zeros(12), np.zeros((2, _SAMPLES, 2))
    for foot, side in enumerate((1.0, -1.0)):
        q = biped.bent_knee
        for i, s in enumerate(np.linspace(0.0, 1.0, _SAMPLES)):
            wanted = _wanted(step, side, s)
            com, left, right = (wanted[0, part] for part in (COM, LEFT, RIGHT))
            found = ik.solve(Posture(com, sole_pose(*left), sole_pose(*right)), q)
            if not found.ok:
                return Preview(speeds, torques, offsets, found.reason)
            q = found.q
            task.set_positions(q)
            inverse = np.linalg.pinv(task.jacobian())
            v = inverse @ wanted[1]
            task.set_state(q, v)
            vdot = inverse @ (wanted[2] - task.bias())
            speeds = np.maximum(speeds, abs(v[biped.v_index]))
            forces = dynamics(q, v, vdot, (1.0 + side) / 2.0)
            torques = np.maximum(torques, abs(forces.tau))
            wrench = forces.left if side > 0.0 else forces.right  # at the sole's centre, the pendulum's ZMP
            offsets[foot, i] = -wrench[4] / wrench[2], wrench[3] / wrench[2]
    return Preview(speeds, torques, offsets, "")


def is_mirrored(seen: Preview, leg: float) -> bool:
    """Whether a step on the left foot moves the ZMP as the mirror image of one on the right foot does.

    Args:
        seen: a preview; one that misses a posture says nothing. leg: length of a leg [m].
    """
    left, right = seen.offsets
    return bool(seen.missed) or float(np.abs(left - right * [1.0, -1.0]).max()) < _MIRRORED * leg


def _wanted(step: Step, side: float, s: float) -> np.ndarray:
    """Place, velocity and acceleration in task coordinates (3, 18) after the share s of a step; `side` stands."""
    omega = math.sqrt(GRAVITY / step.height)
    t, half = step.duration * (s - 0.5), omega * step.duration / 2.0
    sinh, cosh = math.sinh(omega * t), math.cosh(omega * t)
    x, y = step.stride / 2.0 / math.sinh(half), side * step.width / 2.0 / math.cosh(half)
    wanted = np.zeros((3, 18))
    wanted[:, COM.start] = x * sinh, omega * x * cosh, omega**2 * x * sinh
    wanted[:, COM.start + 1] = side * step.width / 2.0 - y * cosh, -omega * y * sinh, -(omega**2) * y * cosh
    wanted[0, COM.start + 2] = step.height
    stance, swing = (LEFT, RIGHT) if side > 0.0 else (RIGHT, LEFT)
    wanted[0, stance] = 0.0, side * step.width / 2.0, 0.0
    back, ahead = (np.array([length, -side * step.width / 2.0]) for length in (-step.stride, step.stride))
    aloft = s * step.duration - (step.duration - step.swing)
    wanted[:, swing] = np.array(swing_point(back, ahead, step.swing_height, step.swing, aloft))
    return wanted
