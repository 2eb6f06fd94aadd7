"""What the controller knows of the robot: CoM, ZMP and soles, from joints, base and ground reaction."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RollPitchYaw
from pydrake.systems.framework import BasicVector, Context, LeafSystem, ValueProducer

from pdhocbf_drake.biped import Biped
from pdhocbf_drake.biped.config import SIDES

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
        self._base_position, self._base = biped.base_q_index[4:], biped.base_v_index
        self._soles = [biped.soles[side].frame for side in SIDES]
        # CoM and soles cost one pass over the robot's kinematics, whichever ports are read.
        producer = ValueProducer(allocate=lambda: AbstractValue.Make(None), calc=self._calc_kinematics)
        self._kinematics = self.DeclareCacheEntry("kinematics", producer, {self._state.ticket()})
        seen = self._kinematics.ticket()
        self.DeclareVectorOutputPort("lip_state", 6, self._lip_state, {self._forces.ticket(), seen})
        self.DeclareVectorOutputPort("com_z", 2, self._com_z, {seen})
        self.DeclareVectorOutputPort("foot_state", 12, self._foot_state, {seen})

    def _calc_kinematics(self, context: Context, value: AbstractValue) -> None:
        plant, state = self._biped.plant, self._state.Eval(context)
        plant.SetPositionsAndVelocities(self._context, state)
        position = plant.CalcCenterOfMassPositionInWorld(self._context).tolist()
        velocity = plant.CalcCenterOfMassTranslationalVelocityInWorld(self._context).tolist()
        poses = [frame.CalcPoseInWorld(self._context) for frame in self._soles]
        value.set_value((position, velocity, state[self._base_position].tolist(), poses))

    def _lip_state(self, context: Context, output: BasicVector) -> None:
        position, velocity, base, _ = self._kinematics.Eval(context)
        mx, my, _, fx, fy, fz = self._forces.Eval(context)[self._base].tolist()
        x, y = position[:2]
        if fz > _LEAST_LOAD:
            x, y = base[0] - (my + base[2] * fx) / fz, base[1] + (mx - base[2] * fy) / fz
        output.SetFromVector([position[0], velocity[0], x, position[1], velocity[1], y])

    def _com_z(self, context: Context, output: BasicVector) -> None:
        position, velocity, _, _ = self._kinematics.Eval(context)
        output.SetFromVector([position[2], velocity[2]])

    def _foot_state(self, context: Context, output: BasicVector) -> None:
        soles = np.empty((2, 6))
        for sole, pose in zip(soles, self._kinematics.Eval(context)[3], strict=True):
            sole[:3], sole[3:] = pose.translation(), RollPitchYaw(pose.rotation()).vector()
        output.SetFromVector(soles.ravel())
