"""The task coordinates by Drake's kinematics and dynamics: of any robot, and what the kernels are compared with."""

from __future__ import annotations

import numpy as np
from pydrake.multibody.tree import JacobianWrtVariable, MultibodyForces

from pdhocbf_drake.robot.biped import Biped
from pdhocbf_drake.robot.posture import COM, LEFT, LEFT_TURN, RIGHT, RIGHT_TURN, TORSO_TURN
from pdhocbf_drake.robot.task_space import TaskSpace

_ORIGIN = np.zeros(3)
_KIND = JacobianWrtVariable.kV


class DrakeTaskSpace(TaskSpace):
    """`TaskSpace` in a context of the robot's plant."""

    def __init__(self, biped: Biped) -> None:
        super().__init__(biped)
        self._plant, self._context = biped.plant, biped.context()
        self._world = biped.plant.world_frame()
        self._frames = biped.torso_frame, *(sole.frame for sole in biped.soles.values())
        self._base, self._mass = biped.base_v_index, biped.mass
        self._forces = MultibodyForces(biped.plant)
        self._poses: np.ndarray | None = None
        self._jacobian: np.ndarray | None = None

    def set_state(self, q: np.ndarray, v: np.ndarray) -> None:
        """Sets q (19,) and v (18,)."""
        self.set_positions(q)
        self._plant.SetVelocities(self._context, v)

    def moved(self, q: np.ndarray, step: np.ndarray) -> np.ndarray:
        """q ⊕ step (18,), by the plant's N(q); sets q, not the result."""
        self.set_positions(q)
        moved = q + self._plant.MapVelocityToQDot(self._context, step)
        quaternion = slice(self._quaternion, self._quaternion + 4)
        moved[quaternion] /= np.linalg.norm(moved[quaternion])
        return moved

    def poses(self) -> np.ndarray:
        """Poses (39,)."""
        if self._poses is None:
            com = self._plant.CalcCenterOfMassPositionInWorld(self._context)
            frames = [frame.CalcPoseInWorld(self._context).GetAsMatrix34().ravel() for frame in self._frames]
            self._poses = np.concatenate([com, *frames])
        return self._poses

    def com_velocity(self) -> np.ndarray:
        """Velocity of the CoM (3,)."""
        return self._plant.CalcCenterOfMassTranslationalVelocityInWorld(self._context)

    def jacobian(self) -> np.ndarray:
        """J(q) (18, 18)."""
        if self._jacobian is None:
            plant, context, world = self._plant, self._context, self._world
            self._jacobian = jacobian = np.empty((18, 18))
            jacobian[COM] = plant.CalcJacobianCenterOfMassTranslationalVelocity(context, _KIND, world, world)
            torso, left, right = (
                plant.CalcJacobianSpatialVelocity(context, _KIND, frame, _ORIGIN, world, world)
                for frame in self._frames
            )
            jacobian[TORSO_TURN] = torso[:3]
            jacobian[LEFT_TURN], jacobian[LEFT] = left[:3], left[3:]
            jacobian[RIGHT_TURN], jacobian[RIGHT] = right[:3], right[3:]
        return self._jacobian

    def bias(self) -> np.ndarray:
        """J̇v (18,)."""
        plant, context, world = self._plant, self._context, self._world
        torso, left, right = (
            plant.CalcBiasSpatialAcceleration(context, _KIND, frame, _ORIGIN, world, world).get_coeffs()
            for frame in self._frames
        )
        # With v̇ = 0 the force on the floating base is the robot's mass times the acceleration of its CoM.
        com = plant.CalcBiasTerm(context)[self._base[3:]] / self._mass
        return np.concatenate([com, torso[:3], left[3:], left[:3], right[3:], right[:3]])

    def forces(self, vdot: np.ndarray) -> np.ndarray:
        """M v̇ + C v − τ_g (18,), with damping."""
        # CalcInverseDynamics leaves gravity and joint damping out unless they are among the applied forces.
        self._plant.CalcForceElementsContribution(self._context, self._forces)
        return self._plant.CalcInverseDynamics(self._context, vdot, self._forces)

    def _place(self, q: np.ndarray) -> None:
        self._plant.SetPositions(self._context, q)
        self._poses = self._jacobian = None
