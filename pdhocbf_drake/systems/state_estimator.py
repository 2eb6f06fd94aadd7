"""What the controller knows of the robot: CoM, ZMP and soles, from joints, base and ground reaction."""

from __future__ import annotations

import math

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from pdhocbf_drake.jit import compiled
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.robot.config import SIDES
from pdhocbf_drake.systems.unbundled import Unbundled

_LEAST_LOAD = 1.0  # [N]: below this nothing stands on the ground and the ZMP is taken to be below the CoM


class StateEstimator(Unbundled):
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
        super().__init__(_StateEstimator(biped), {"lip_state": 6, "com_z": 2, "foot_state": 12})


class _StateEstimator(LeafSystem):
    """`StateEstimator` with one output."""

    def __init__(self, biped: Biped) -> None:
        super().__init__()
        self._biped = biped
        self._context = biped.plant.CreateDefaultContext()
        self._state = self.DeclareVectorInputPort("robot_state", 37)
        self._forces = self.DeclareVectorInputPort("contact_forces", 18)
        self._origin, self._base = biped.base_q_index[4:], biped.base_v_index
        self._left, self._right = (biped.soles[side].frame for side in SIDES)
        self.DeclareVectorOutputPort("estimate", 20, self._calc, {self._state.ticket(), self._forces.ticket()})

    def _calc(self, context: Context, output: BasicVector) -> None:
        plant, here, state = self._biped.plant, self._context, self._state.Eval(context)
        plant.SetPositionsAndVelocities(here, state)
        com = plant.CalcCenterOfMassPositionInWorld(here)
        velocity = plant.CalcCenterOfMassTranslationalVelocityInWorld(here)
        left = self._left.CalcPoseInWorld(here).GetAsMatrix34()
        right = self._right.CalcPoseInWorld(here).GetAsMatrix34()
        estimate = np.empty(20)
        _write_com(com, velocity, state, self._origin, self._forces.Eval(context), self._base, estimate)
        _write_soles(left, right, estimate)
        output.SetFromVector(estimate)


@compiled
def _write_com(
    com: np.ndarray, velocity: np.ndarray, q: np.ndarray, origin: np.ndarray, force: np.ndarray, base: np.ndarray,
    out: np.ndarray,
) -> None:  # fmt: skip
    """lip_state and com_z: the CoM, and the ZMP from where the base's origin is in q and its force in v."""
    mx, my = force[base[0]], force[base[1]]
    fx, fy, fz = force[base[3]], force[base[4]], force[base[5]]
    x, y, z = q[origin[0]], q[origin[1]], q[origin[2]]
    on_ground = fz > _LEAST_LOAD
    out[0], out[1], out[2] = com[0], velocity[0], x - (my + z * fx) / fz if on_ground else com[0]
    out[3], out[4], out[5] = com[1], velocity[1], y + (mx - z * fy) / fz if on_ground else com[1]
    out[6], out[7] = com[2], velocity[2]


@compiled
def _write_soles(left: np.ndarray, right: np.ndarray, out: np.ndarray) -> None:
    """foot_state: xyz, then roll, pitch and yaw, of two poses (3, 4) with R = R_z(yaw) R_y(pitch) R_x(roll).

    They are those of Drake's `RollPitchYaw`, which would have to be asked four times for each sole.
    """
    for start, pose in ((8, left), (14, right)):
        for i in range(3):
            out[start + i] = pose[i, 3]
        out[start + 3] = math.atan2(pose[2, 1], pose[2, 2])
        out[start + 4] = math.atan2(-pose[2, 0], math.hypot(pose[2, 1], pose[2, 2]))
        out[start + 5] = math.atan2(pose[1, 0], pose[0, 0])
