"""What became of a tick in the whole-body layer."""

from __future__ import annotations

from enum import IntEnum


class Reason(IntEnum):
    """Why the motion of a tick is what it is; from `TORQUE` on something is missed."""

    INSIDE = 0
    """The closed form keeps all limits, and is what is planned."""
    KEPT = 1
    """The quadratic program keeps all limits."""
    TORQUE = 2
    """No motion of height, torso and swing foot keeps a joint's torque; it is exceeded by as little as can be."""
    LOAD = 3
    """A sole would have to pull at the ground."""
    FRICTION = 4
    """The ground's force along it is beyond friction."""
    COP = 5
    """A sole's centre of pressure is beyond its edge."""
    TWIST = 6
    """A sole's moment about the vertical is beyond friction."""
    JOINTS = 7
    """The limits of joint angles and speeds take more than height, torso and swing foot: CoM and soles give way."""
    NOT_OPTIMAL = 8
    """No program has an answer: joint accelerations are clipped to what their barriers allow."""
    UNREACHED = 9
    """Inverse kinematics misses its target, whose motion has no program."""
    RATE = 10
    """A joint's target would move faster than the joint can; it moves at the joint's largest speed."""


SOFTENED = (Reason.TORQUE, Reason.LOAD, Reason.FRICTION, Reason.COP, Reason.TWIST)
"""The limits that a program exceeds by as little as can be, in the order of its slacks."""
