"""What the controller knows of the robot: CoM, ZMP and soles, from joints, base and ground reaction."""

from __future__ import annotations

import math

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, LeafSystem, ValueProducer

from pdhocbf_drake.biped import Biped
from pdhocbf_drake.biped.config import SIDES
from pdhocbf_drake.jit import compiled

_LEAST_LOAD = 1.0  # [N]: below this nothing stands on the ground and the ZMP is taken to be below the CoM


class StateEstimator(LeafSystem):
    """CoM by kinematics, ZMP by the ground's wrench on the robot (Remark 8), here from the true state.

    The ground's generalized force on the floating base is the net contact wrench about the base's origin b:
    moment M, force F. The ZMP is the point of the ground where its horizontal moment vanishes:
    x = b_x − (M_y + b_z F_x)/F_z,  y = b_y + (M_x − b_z F_y)/F_z.

    Input ports:
        robot_state (37): q and v of the plant. contact_forces (18): generalized contact forces.
    Output ports:
        lip_state (6), com_z (2), foot_state (12): as in `simulation.signals`.
    """

    def __init__(self, biped: Biped) -> None:
        super().__init__()
        self._biped = biped
        self._context = biped.plant.CreateDefaultContext()
        self._state = self.DeclareVectorInputPort("robot_state", 37)
        self._forces = self.DeclareVectorInputPort("contact_forces", 18)
        self._origin, self._base = biped.base_q_index[4:], biped.base_v_index
        self._left, self._right = (biped.soles[side].frame for side in SIDES)
        # CoM and soles cost one pass over the robot's kinematics, whichever ports are read.
        producer = ValueProducer(allocate=lambda: AbstractValue.Make(None), calc=self._calc_kinematics)
        self._kinematics = self.DeclareCacheEntry("kinematics", producer, {self._state.ticket()})
        seen = self._kinematics.ticket()
        self.DeclareVectorOutputPort("lip_state", 6, self._lip_state, {self._forces.ticket(), seen})
        self.DeclareVectorOutputPort("com_z", 2, self._com_z, {seen})
        self.DeclareVectorOutputPort("foot_state", 12, self._foot_state, {seen})

    def _calc_kinematics(self, context: Context, value: AbstractValue) -> None:
        plant, here, state = self._biped.plant, self._context, self._state.Eval(context)
        plant.SetPositionsAndVelocities(here, state)
        position = plant.CalcCenterOfMassPositionInWorld(here)
        velocity = plant.CalcCenterOfMassTranslationalVelocityInWorld(here)
        left = self._left.CalcPoseInWorld(here).GetAsMatrix34()
        right = self._right.CalcPoseInWorld(here).GetAsMatrix34()
        value.set_value((position, velocity, state, left, right))

    def _lip_state(self, context: Context, output: BasicVector) -> None:
        position, velocity, state, _, _ = self._kinematics.Eval(context)
        lip = np.empty(6)
        _write_lip(position, velocity, state, self._origin, self._forces.Eval(context), self._base, lip)
        output.SetFromVector(lip)

    def _com_z(self, context: Context, output: BasicVector) -> None:
        position, velocity, _, _, _ = self._kinematics.Eval(context)
        output.SetFromVector([position[2], velocity[2]])

    def _foot_state(self, context: Context, output: BasicVector) -> None:
        _, _, _, left, right = self._kinematics.Eval(context)
        soles = np.empty(12)
        _write_soles(left, right, soles)
        output.SetFromVector(soles)


@compiled
def _write_lip(
    position: np.ndarray, velocity: np.ndarray, q: np.ndarray, origin: np.ndarray, force: np.ndarray, base: np.ndarray,
    lip: np.ndarray,
) -> None:  # fmt: skip
    """[c, v, ZMP] of x, then y, (6,), from the CoM, and from where the base's origin is in q and its force in v."""
    mx, my = force[base[0]], force[base[1]]
    fx, fy, fz = force[base[3]], force[base[4]], force[base[5]]
    x, y, z = q[origin[0]], q[origin[1]], q[origin[2]]
    on_ground = fz > _LEAST_LOAD
    lip[0], lip[1], lip[2] = position[0], velocity[0], x - (my + z * fx) / fz if on_ground else position[0]
    lip[3], lip[4], lip[5] = position[1], velocity[1], y + (mx - z * fy) / fz if on_ground else position[1]


@compiled
def _write_soles(left: np.ndarray, right: np.ndarray, soles: np.ndarray) -> None:
    """xyz, then roll, pitch and yaw, of two poses (3, 4) with R = R_z(yaw) R_y(pitch) R_x(roll), (12,)."""
    for start, pose in ((0, left), (6, right)):
        for i in range(3):
            soles[start + i] = pose[i, 3]
        soles[start + 3] = math.atan2(pose[2, 1], pose[2, 2])
        soles[start + 4] = math.atan2(-pose[2, 0], math.hypot(pose[2, 1], pose[2, 2]))
        soles[start + 5] = math.atan2(pose[1, 0], pose[0, 0])
