"""Do the legs touch each other? A robot whose legs pass through each other has not survived."""

from __future__ import annotations

import numpy as np
from pydrake.multibody.plant import ContactResults
from pydrake.systems.framework import Context, Diagram

from pdhocbf_drake.robot import Biped

WORLD = 0  # the index of the ground's body


def legs_in_contact(results: ContactResults) -> bool:
    """True where two bodies of the robot touch."""
    pairs = (results.point_pair_contact_info(i) for i in range(results.num_point_pair_contacts()))
    return any(int(p.bodyA_index()) != WORLD and int(p.bodyB_index()) != WORLD for p in pairs)


def soles_overlap(poses: np.ndarray, halves: np.ndarray) -> bool:
    """True where the two soles, rectangles seen from above, share ground: no edge of either separates them.

    Args:
        poses: x, y, yaw of the left and right sole's centre, shape (2, 3) [m, rad].
        halves: half length and half width of each, shape (2, 2) [m].
    """
    axes = [np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]]) for yaw in poses[:, 2]]
    apart = poses[1, :2] - poses[0, :2]
    for direction in np.vstack(axes):
        reach = sum(float(half @ np.abs(axis @ direction)) for half, axis in zip(halves, axes, strict=True))
        if abs(float(apart @ direction)) >= reach:
            return False
    return True


class LegWatch:
    """Watches the legs of the robot in a diagram: touching bodies, by contact, and overlapping soles."""

    def __init__(self, diagram: Diagram, biped: Biped) -> None:
        self._plant = diagram.GetSubsystemByName("plant")
        self._estimator = diagram.GetSubsystemByName("state_estimator")
        self._halves = np.array([biped.soles[side].half_size for side in ("left", "right")])

    def touch(self, context: Context) -> bool:
        """Whether the legs touch, in a context of the whole diagram."""
        plant = self._plant.GetMyContextFromRoot(context)
        if legs_in_contact(self._plant.get_contact_results_output_port().Eval(plant)):
            return True
        estimator = self._estimator.GetMyContextFromRoot(context)
        feet = self._estimator.GetOutputPort("foot_state").Eval(estimator).reshape(2, 6)
        return soles_overlap(feet[:, [0, 1, 5]], self._halves)
