"""The task coordinates by the kernels of `multibody`, which take a tenth of the time that calls of Drake take."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.robot.biped import Biped
from pdhocbf_drake.robot.drake_task_space import DrakeTaskSpace
from pdhocbf_drake.robot.multibody import kernels
from pdhocbf_drake.robot.multibody.tree import Tree
from pdhocbf_drake.robot.posture import TargetPoses
from pdhocbf_drake.robot.task_space import (
    FARTHEST,
    LARGEST_RATE,
    LARGEST_STEP,
    NEWTON_STEPS,
    TOLERANCE,
    MovedAlong,
    TaskSpace,
)


class TreeTaskSpace(TaskSpace):
    """`TaskSpace` of a robot whose parts the kernels model."""

    def __init__(self, biped: Biped, tree: Tree) -> None:
        super().__init__(biped)
        self._links, self._numbers, self._lift = tree
        self._work = np.zeros((len(tree.links), kernels.WORK))
        self._q, self._v = np.zeros(len(biped.bent_knee)), np.zeros(18)
        self._poses, self._has_jacobian = np.empty(39), False
        self._error, self._step, self._moved = np.empty(18), np.empty(18), np.empty(len(self._q))
        self._places = np.array([biped.q_index, biped.v_index], dtype=np.int64)
        self._bounds = np.array([*biped.position_limits.T, biped.velocity_limits])
        self._base = np.concatenate([biped.base_v_index, biped.base_q_index[4:]]).astype(np.int64)
        self._vectors, self._matrices = np.empty((4, len(self._q))), np.empty((2, 18, 18))
        self._jacobian = self._matrices[0]

    def set_state(self, q: np.ndarray, v: np.ndarray) -> None:
        """Sets q (19,) and v (18,)."""
        self.set_positions(q)
        self._v[:] = v

    def moved(self, q: np.ndarray, step: np.ndarray) -> np.ndarray:
        """q ⊕ step (18,)."""
        moved = np.empty(len(q))
        kernels.move(q, step, self._links, moved)
        return moved

    def poses(self) -> np.ndarray:
        """Poses (39,)."""
        return self._poses

    def poses_and_velocity(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """`poses` and `com_velocity` at q (19,) and v (18,), in one call."""
        self._key, self._has_jacobian, self._factorized, velocity = b"", False, None, np.empty(3)
        self._v[:] = v
        kernels.write_poses_and_velocity(q, v, self._links, self._numbers, self._work, self._poses, velocity)
        return self._poses, velocity

    def com_velocity(self) -> np.ndarray:
        """Velocity of the CoM (3,)."""
        velocity = np.empty(3)
        kernels.write_com_velocity(self._v, self._links, self._numbers, self._work, velocity)
        return velocity

    def jacobian(self) -> np.ndarray:
        """J(q) (18, 18)."""
        if not self._has_jacobian:
            kernels.write_jacobian(self._links, self._numbers, self._work, self._jacobian)
            self._has_jacobian = True
        return self._jacobian

    def bias(self) -> np.ndarray:
        """J̇v (18,)."""
        bias = np.empty(18)
        kernels.write_bias(self._v, np.zeros(18), self._links, self._numbers, self._work, bias)
        return bias

    def forces(self, vdot: np.ndarray) -> np.ndarray:
        """M v̇ + C v − τ_g (18,), with damping."""
        forces = np.empty(18)
        kernels.write_forces(self._v, vdot, self._lift, self._links, self._numbers, self._work, forces)
        return forces

    def inertial_forces(self, accelerations: np.ndarray) -> np.ndarray:
        """M a for each column a of the accelerations (18, n), in one call."""
        columns = np.ascontiguousarray(accelerations.T)
        forces = np.empty_like(columns)
        kernels.write_inertial_forces(columns, np.zeros(18), self._links, self._numbers, self._work, forces)
        return forces.T

    def approach(self, goal: TargetPoses, q: np.ndarray) -> tuple[np.ndarray, int, float]:
        """Newton's method in one call; where that gives up, as that of `TaskSpace`, which takes half a revolution."""
        q = q.copy()
        steps = kernels.approach(
            q, goal.map, goal.offset, TOLERANCE, NEWTON_STEPS, LARGEST_STEP, self._q_index, self._lower, self._upper,
            self._links, self._numbers, self._work, self._poses, self._error, self._step, self._moved, self._factors,
            self._pivots,
        )  # fmt: skip
        self._key, self._has_jacobian, self._factorized = b"", False, None
        if steps < 0:
            return self._approach(goal, q, -1 - steps)
        self._key = q.tobytes()
        return q, steps, kernels.largest(self._error)

    def move_along(self, goal: TargetPoses, seed: np.ndarray, wanted: np.ndarray, share: float) -> MovedAlong | None:
        """All of it; None where Newton's method gives up, or the motion is none to follow."""
        count = len(seed)
        found = np.empty(count + 60)
        steps, worst = kernels.move_along(
            seed, goal.map, goal.offset, wanted, share, TOLERANCE, NEWTON_STEPS, LARGEST_STEP, FARTHEST, LARGEST_RATE,
            self._places, self._bounds, self._base, self._lift, self._links, self._numbers, self._work, self._poses,
            self._vectors, self._matrices, self._pivots, found,
        )  # fmt: skip
        if steps < 0:
            self._key, self._has_jacobian, self._factorized = b"", False, None
            return None
        q, v = found[:count], found[count : count + 18]
        self._key, self._has_jacobian, self._factorized = q.tobytes(), True, None
        self._v[:] = v
        return MovedAlong(q, v, found[count + 18 : count + 36], found[count + 36 :], steps, worst)

    def descend(
        self, goal: TargetPoses, q: np.ndarray, weights: np.ndarray, steps: int
    ) -> tuple[np.ndarray, int, float, bool]:
        """Levenberg-Marquardt in one call, up to a turn near half a revolution."""
        q = q.copy()
        done = kernels.descend(
            q, goal.map, goal.offset, weights, TOLERANCE, steps, self._q_index, self._joints, self._lower, self._upper,
            self._links, self._numbers, self._work, self._poses, np.empty((5, 18)), self._moved,
            np.empty((3, 18, 18)), self._pivots,
        )  # fmt: skip
        self._key, self._factorized = b"", None
        return q, *done

    def follow(
        self, q: np.ndarray, rates: np.ndarray, accelerations: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """v and v̇ (18,) in one call."""
        self.set_positions(q)
        v, vdot = np.empty(18), np.empty(18)
        followed = kernels.follow(
            rates, accelerations, self._joints, self._speeds, LARGEST_RATE, self._links, self._numbers, self._work,
            self._jacobian, self._factors, self._pivots, self._step, v, vdot,
        )  # fmt: skip
        self._has_jacobian, self._factorized = True, None
        return (v, vdot) if followed else None

    def _place(self, q: np.ndarray) -> None:
        kernels.write_poses(q, self._links, self._numbers, self._work, self._poses)
        self._has_jacobian = False


def task_space_of(biped: Biped) -> TaskSpace:
    """The robot's task space by kernels, or by Drake if it has parts that they do not model."""
    return DrakeTaskSpace(biped) if biped.tree is None else TreeTaskSpace(biped, biped.tree)
