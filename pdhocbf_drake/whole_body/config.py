"""Config of the whole-body layer: when it is solved, and what giving way costs."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, field_validator

from pdhocbf_drake.barriers.class_k import Linear
from pdhocbf_drake.config import Config, within

_Price = Annotated[float, within(1e-6, 1e6, "")]


class WholeBodyConfig(Config):
    """How the planned motion is kept within the limits of joints and soles.

    A price is that of a squared acceleration away from the reference, [s⁴/m²] or [s⁴/rad²].

    Attributes:
        kind: "auto" solves a quadratic program in ticks in which the closed form exceeds a limit; "qp" solves it in
            every tick; "closed_form" leaves limits to the motors and the ground.
        height: price of the CoM's height. It is dear, since a CoM that gives way downwards bends the knees further.
        torso: price of the torso's roll and pitch.
        torso_yaw: price of the torso's yaw.
        swing: price of the swinging foot's place, and of its turn at the corners of its sole.
        joint_gamma: γ_1, γ_2 of the barriers on joint angles, at most 1 together [1].
        torque_rate: largest rate of the feedforward torques; null leaves it free [N m/s].
    """

    kind: Literal["auto", "closed_form", "qp"] = "auto"
    height: _Price = 100.0
    torso: _Price = 0.05
    torso_yaw: _Price = 0.001
    swing: _Price = 0.1
    joint_gamma: tuple[float, float] = (0.3, 0.3)
    torque_rate: float | None = Field(None, gt=0, le=1e9)

    @field_validator("joint_gamma")
    @classmethod
    def _keeps_an_interval(cls, gamma: tuple[float, float]) -> tuple[float, float]:
        for rate in gamma:
            Linear(rate)
        if sum(gamma) > 1.0:
            raise ValueError(f"the two must be at most 1 together (given: {sum(gamma):g})")
        return gamma
