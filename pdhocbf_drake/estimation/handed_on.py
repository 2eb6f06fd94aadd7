"""CoM, ZMP and soles for the controller, counted from the foot that stands."""

from __future__ import annotations

import math

import numpy as np

from pdhocbf_drake.estimation.kernels import DP, DSOLES, DV, GYRO_BIAS, OFFSETS, SOLES, P, R, V
from pdhocbf_drake.estimation.legs import Legs
from pdhocbf_drake.estimation.memory import Memory
from pdhocbf_drake.estimation.sample import Estimate, Notice

_SHARE = 0.6  # of both feet's load, from which a foot takes over as the one that is held
_ONE = np.eye(3)
_SIDE, _PLACE, _SHIFT = 0, slice(1, 3), slice(3, 5)


def hold_stance(memory: Memory) -> None:
    """Keeps the stance foot where it was when it took the load: moves `anchor` on.

    The controller plans from a foot at rest, so a correction of the estimated world must not move that foot. What is
    handed on is the estimate plus a shift that holds the foot in place; at a load transfer the shift stays, and the
    other foot is held.
    """
    anchor, loads = memory.anchor, memory.force_torque[5::6]
    side = int(anchor[_SIDE])
    if memory.standing[1 - side] and (
        not memory.loaded[side] or loads[1 - side] > _SHARE * max(loads[0] + loads[1], 1.0)
    ):
        side = 1 - side
        anchor[_SIDE], anchor[_PLACE] = side, np.nan
    sole = memory.estimate[SOLES + 3 * side : SOLES + 3 * side + 2]
    if not memory.standing[side]:
        anchor[_PLACE] = np.nan  # a foot that rocks moves indeed
    elif math.isnan(anchor[1]):
        anchor[_PLACE] = sole + anchor[_SHIFT]
    else:
        anchor[_SHIFT] = anchor[_PLACE] - sole


def hand_on(
    memory: Memory, legs: Legs, rates: np.ndarray, turning: np.ndarray, least: float, status: tuple[Notice, float, int]
) -> Estimate:
    """What the controller is given.

    c = p + R s(θ),  ċ = v + ω × R s + R ∂s/∂θ θ̇, with ω the last rate less its bias.

    Args:
        rates: θ̇ (12,) [rad/s]. turning: the base's rate at the tick, in its axes (3,) [rad/s].
        least: load above which there is a ZMP [N].
        status: what was noticed, squared innovations, and their number.
    """
    estimate, shift = memory.estimate, memory.anchor[_SHIFT]
    rotation = estimate[R : R + 9].reshape(3, 3)
    arm = rotation @ legs.com
    omega = turning - estimate[GYRO_BIAS : GYRO_BIAS + 3]
    com = estimate[P : P + 3] + arm
    velocity = estimate[V : V + 3] + rotation @ (_crossed(omega, legs.com) + legs.com_rates @ rates)
    com[:2] += shift
    feet, pressed, load = np.empty(12), np.zeros(2), 0.0
    for side in (0, 1):
        sole, turn = estimate[SOLES + 3 * side : SOLES + 3 * side + 3], rotation @ legs.turns[side].reshape(3, 3)
        start, (mx, my, _, _, _, fz) = 6 * side, memory.force_torque[6 * side : 6 * side + 6].tolist()
        feet[start : start + 3] = sole
        feet[start : start + 2] += shift
        feet[start + 3] = math.atan2(turn[2, 1], turn[2, 2])
        feet[start + 4] = math.atan2(-turn[2, 0], math.hypot(turn[2, 1], turn[2, 2]))
        feet[start + 5] = math.atan2(turn[1, 0], turn[0, 0])
        if fz > 0.5 * least:
            # f_z times the sole's place plus R [−m_y, m_x]
            pressed += fz * feet[start : start + 2] + turn[:2, 1] * mx - turn[:2, 0] * my
            load += fz
    if load > least:
        memory.zmp[:] = pressed / load
    elif not memory.zmp.any():
        memory.zmp[:] = com[:2]
    lip = np.array([com[0], velocity[0], memory.zmp[0], com[1], velocity[1], memory.zmp[1]])
    notice, nis, count = status
    shown = np.array([notice, *memory.loaded, *memory.standing, nis, count, memory.anchor[_SIDE]], dtype=float)
    deviation = _deviation(memory, legs, rotation)
    return Estimate(lip, np.array([com[2], velocity[2]]), feet, deviation, shown)


def _deviation(memory: Memory, legs: Legs, rotation: np.ndarray) -> np.ndarray:
    """Of CoM from the stance foot and of the CoM's velocity (6,): those of the base, and of the encoders' offsets."""
    covariance, foot = memory.covariance, DSOLES + 3 * int(memory.anchor[_SIDE])
    rows = np.zeros((3, len(covariance)))
    rows[:, DP : DP + 3], rows[:, foot : foot + 3], rows[:, OFFSETS:] = _ONE, -_ONE, rotation @ legs.com_rates
    place = ((rows @ covariance) * rows).sum(axis=1)
    return np.sqrt(np.maximum([*place, *covariance.diagonal()[DV : DV + 3]], 0.0))


def _crossed(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a × b, in a tenth of the time that numpy takes for three numbers."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])
