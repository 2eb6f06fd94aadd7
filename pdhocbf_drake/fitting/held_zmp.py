"""The ZMP that the joints of a leg hold which stands alone, tick by tick of a step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from pdhocbf_drake.robot import ROLES, SIDES, Biped, InverseDynamics, Posture, WholeBodyIk, sole_pose
from pdhocbf_drake.robot.posture import COM
from pdhocbf_drake.walking.com_height import CosineHeight
from pdhocbf_drake.walking.config import GaitConfig

_LEG: Final = slice(len(ROLES))  # the left one
_ROLES = ("hip_pitch", "knee_pitch")
_NEAR, _COUNT = 0.17, 5  # how far the CoM is from the sole's centre at most, over its height, and places tried
_TORQUE = 0.9  # share of a joint's torque; the rest is for the PD, which holds up a robot that has sunk


class HeldZmp(NamedTuple):
    """Least and largest ZMP ahead of the sole's centre that a leg holds, (N, n) each [m].

    With the CoM at c ahead of the sole, the torques τ = τ_0 + τ_1 c̈ of inverse dynamics, at rest and with the other
    foot as far from the CoM, keep their limits for an interval of c̈, and so of the ZMP p = c − c̈/eta. `low` is above
    `high` where the joints hold no ZMP on the sole; they are infinite where the leg is too short.

    Attributes:
        places: c (n,) [m].
    """

    low: np.ndarray
    high: np.ndarray
    places: np.ndarray

    @classmethod
    def of(cls, biped: Biped, gait: GaitConfig, roles: Sequence[str], places: np.ndarray, share: float) -> HeldZmp:
        """What a share of the torque of these joints of a leg holds, by the weaker one of both legs."""
        height, half, count = CosineHeight(gait), gait.stance_width / 2.0, biped.plant.num_velocities()
        ik, rest, joints = WholeBodyIk(biped), np.zeros(count), [ROLES.index(role) for role in roles]
        dynamics = InverseDynamics(biped, ik.task_space)
        limits = share * biped.effort_limits.reshape(2, -1).min(axis=0)[joints]
        sole = min(float(biped.soles[side].half_size[0]) for side in SIDES)
        low, high = (np.full((gait.ticks_per_step, len(places)), value) for value in (np.inf, -np.inf))
        for tick, eta in enumerate(height.eta()):
            z, _, lift = height(tick)
            for place, c in enumerate(places.tolist()):
                feet = sole_pose(0.0, half), sole_pose(2.0 * c, -half)
                found = ik.solve(Posture(np.array([c, 0.0, z]), *feet), biped.bent_knee)
                if not found.ok:
                    continue
                torques = []
                for ahead in (0.0, 1.0):
                    wanted = rest.copy()
                    wanted[COM] = ahead, -eta * half, lift
                    _, vdot = ik.derivatives(found.q, rest, wanted)
                    torques.append(dynamics(found.q, rest, vdot, 1.0).tau[_LEG][joints])
                still, slope = torques[0], torques[1] - torques[0]
                with np.errstate(divide="ignore", invalid="ignore"):  # of a joint that c̈ doesn't load
                    ends = np.sort((np.outer([-1.0, 1.0], limits) - still) / slope, axis=0)
                low[tick, place] = max(c - ends[1].min() / eta, -sole)
                high[tick, place] = min(c - ends[0].max() / eta, sole)
        return cls(low, high, places)


def held_zmp(biped: Biped, gait: GaitConfig) -> tuple[tuple[float, float], ...]:
    """`mpc.limits.zmp_held`: what hip and knee hold wherever the CoM is near the stance foot.

    Empty where that is all of the sole at every tick.
    """
    places = np.linspace(-_NEAR, _NEAR, _COUNT) * gait.com_height
    held = HeldZmp.of(biped, gait, _ROLES, places, _TORQUE)
    reached = np.isfinite(held.low)
    low = np.where(reached, held.low, -np.inf).max(axis=1)
    high = np.where(reached, held.high, np.inf).min(axis=1)
    sole = min(float(biped.soles[side].half_size[0]) for side in SIDES)
    ends = np.clip([low, np.maximum(low, high)], -sole, sole)
    if (ends == [[-sole], [sole]]).all():
        return ()
    return tuple((back, ahead) for back, ahead in np.round(ends.T, 4).tolist())
