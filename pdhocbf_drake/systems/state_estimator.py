"""What the controller knows of the robot: CoM, ZMP and soles, from joints, base and ground reaction."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RollPitchYaw
from pydrake.systems.framework import BasicVector, Context, LeafSystem, ValueProducer

from pdhocbf_drake.biped import Biped

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
        state = self.DeclareVectorInputPort("robot_state", 37).ticket()
        forces = self.DeclareVectorInputPort("contact_forces", 18).ticket()
        # CoM and soles cost one pass over the robot's kinematics, whichever ports are read.
        producer = ValueProducer(allocate=lambda: AbstractValue.Make(None), calc=self._calc_kinematics)
        self._kinematics = self.DeclareCacheEntry("kinematics", producer, {state})
        seen = self._kinematics.ticket()
        self.DeclareVectorOutputPort("lip_state", 6, self._lip_state, {state, forces, seen})
        self.DeclareVectorOutputPort("com_z", 2, self._com_z, {seen})
        self.DeclareVectorOutputPort("foot_state", 12, self._foot_state, {seen})

    def _calc_kinematics(self, context: Context, value: AbstractValue) -> None:
        plant = self._biped.plant
        plant.SetPositionsAndVelocities(self._context, self.GetInputPort("robot_state").Eval(context))
        position = plant.CalcCenterOfMassPositionInWorld(self._context)
        velocity = plant.CalcCenterOfMassTranslationalVelocityInWorld(self._context)
        poses = [self._biped.soles[side].frame.CalcPoseInWorld(self._context) for side in ("left", "right")]
        value.set_value((position, velocity, poses))

    def _lip_state(self, context: Context, output: BasicVector) -> None:
        state = self.GetInputPort("robot_state").Eval(context)
        position, velocity, _ = self._kinematics.Eval(context)
        forces = self.GetInputPort("contact_forces").Eval(context)[self._biped.base_v_index]
        base = state[self._biped.base_q_index[4:]]
        zmp = _zmp(forces[:3], forces[3:], base) if forces[5] > _LEAST_LOAD else position[:2]
        output.SetFromVector([position[0], velocity[0], zmp[0], position[1], velocity[1], zmp[1]])

    def _com_z(self, context: Context, output: BasicVector) -> None:
        position, velocity, _ = self._kinematics.Eval(context)
        output.SetFromVector([position[2], velocity[2]])

    def _foot_state(self, context: Context, output: BasicVector) -> None:
        parts = []
        for pose in self._kinematics.Eval(context)[2]:
            parts += [pose.translation(), RollPitchYaw(pose.rotation()).vector()]
        output.SetFromVector(np.concatenate(parts))


def _zmp(moment: np.ndarray, force: np.ndarray, base: np.ndarray) -> np.ndarray:
    x = base[0] - (moment[1] + base[2] * force[0]) / force[2]
    y = base[1] + (moment[0] - base[2] * force[1]) / force[2]
    return np.array([x, y])
