"""Postures and robots shared by the biped's tests."""

from __future__ import annotations

from functools import cache

import numpy as np
from pydrake.math import RollPitchYaw

from pdhocbf_drake.robot import Biped, Posture, WholeBodyIk, sole_pose


@cache
def biped() -> Biped:
    return Biped.load("biped")


@cache
def ik() -> WholeBodyIk:
    return WholeBodyIk(biped())


def posture_at(q: np.ndarray) -> Posture:
    """CoM, soles and torso at q (19,), by Drake's own kinematics."""
    context = biped().plant.CreateDefaultContext()
    biped().plant.SetPositions(context, q)
    frames = (biped().soles["left"].frame, biped().soles["right"].frame, biped().torso_frame)
    poses = [frame.CalcPoseInWorld(context) for frame in frames]
    angles = [RollPitchYaw(pose.rotation()).vector() for pose in poses]
    left, right = (np.concatenate([poses[i].translation(), angles[i]]) for i in range(2))
    return Posture(biped().plant.CalcCenterOfMassPositionInWorld(context), left, right, angles[2])


def standing(height: float = 0.58) -> Posture:
    return Posture(np.array([0.02, 0.0, height]), sole_pose(0.02, 0.08), sole_pose(0.02, -0.08))


def random_posture(rng: np.random.Generator) -> Posture:
    """Any moment of a walk with strides up to 0.2 m, and then some: tilted soles and a leaning torso."""
    left = np.array([*rng.uniform((-0.12, 0.07, 0), (0.12, 0.11, 0.05)), *rng.uniform(-0.12, 0.12, 3)])
    right = np.array([*rng.uniform((-0.12, -0.11, 0), (0.12, -0.07, 0.05)), *rng.uniform(-0.12, 0.12, 3)])
    com = np.array([*rng.uniform(-0.04, 0.04, 2), rng.uniform(0.52, 0.59)])
    return Posture(com, left, right, rng.uniform(-0.1, 0.1, 3))


def mirrored(posture: Posture) -> Posture:
    """The same posture seen in a mirror at y = 0: y, roll and yaw change sign, left and right change places."""
    vector, angles = np.array([1, -1, 1]), np.array([-1, 1, -1])
    sole = np.concatenate([vector, angles])
    return Posture(posture.com * vector, posture.right * sole, posture.left * sole, posture.torso_rpy * angles)


def mirrored_joints(joints: np.ndarray) -> np.ndarray:
    """Joint angles of the mirror image: yaw and roll change sign, legs change places."""
    return np.roll(joints, 6) * np.tile([-1, -1, 1, 1, 1, -1], 2)
