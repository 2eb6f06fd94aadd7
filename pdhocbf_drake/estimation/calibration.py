"""Zero positions of the encoders from several standing postures: both soles flat on level ground, where they are."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.estimation.legs import Legs

_STEPS = 4
_STEP = 1e-6  # [rad], of the differences
_GRAVITY = 9.81


def calibrated_offsets(
    legs: Legs, angles: np.ndarray, forces: np.ndarray, offset: float, bias: float, place: float = 3e-4,
    tilt: float = 3e-4, noise: float = 2e-3,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """The likeliest errors ε of the encoders' zero positions, and their covariance.

    In every posture of one stand (squats, shifts, bows, turns of the torso) one sole has the same place and heading in
    the other, both normals are the same, and the accelerometer says that normal times g, but for its bias. Gauss and
    Newton on ε, on place and heading of the one sole in the other, and on the bias, all with priors.

    Args:
        angles: as the encoders give them in each posture at rest, (n, 12) [rad].
        forces: mean specific force in each, in the base's axes (n, 3) [m/s²].
        offset: standard deviation of the zero positions [rad]. bias: of the accelerometer [m/s²].
        place: of a sole's place [m]. tilt: of its tilt [rad]. noise: of the mean force [m/s²].

    Returns:
        ε, to be taken off the encoders (12,) [rad], and its covariance (12, 12).
    """
    count = angles.shape[1]
    unknown = np.zeros(count + 7)  # ε, place and heading of the right sole in the left one, bias
    unknown[count : count + 4] = _relative(legs, angles[0])
    start = unknown.copy()
    prior = np.concatenate([np.full(count, offset), np.full(3, 0.1), [0.1], np.full(3, bias)])
    weights = np.concatenate([1.0 / prior, np.tile(_weights(place, tilt, noise), len(angles))])

    def residuals(values: np.ndarray) -> np.ndarray:
        rows = [values - start]
        for measured, force in zip(angles, forces, strict=True):
            rows.append(_posture(legs, measured - values[:count], force, values[count:]))
        return weights * np.concatenate(rows)

    for _ in range(_STEPS):
        now = residuals(unknown)
        slopes = np.array([residuals(unknown + step) - now for step in _STEP * np.eye(len(unknown))]).T / _STEP
        unknown = unknown - np.linalg.lstsq(slopes, now, rcond=None)[0]
    return unknown[:count], np.linalg.inv(slopes.T @ slopes)[:count, :count]


def _weights(place: float, tilt: float, noise: float) -> np.ndarray:
    return 1.0 / np.concatenate([np.full(3, place), np.full(3, tilt), np.full(3, noise)])


def _relative(legs: Legs, angles: np.ndarray) -> np.ndarray:
    """Place and heading of the right sole in the left one (4,)."""
    legs.set_joints(angles)
    left, right = legs.turns.reshape(2, 3, 3)
    turn = left.T @ right
    return np.array([*left.T @ (legs.ways[1] - legs.ways[0]), np.arctan2(turn[1, 0], turn[0, 0])])


def _posture(legs: Legs, angles: np.ndarray, force: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """Nine residuals: place (3), tilt (2) and heading of the right sole in the left one, and the force (3)."""
    found = _relative(legs, angles)
    left, right = legs.turns.reshape(2, 3, 3)
    normal = left.T @ right[:, 2]
    up = left[:, 2] + right[:, 2]
    expected = _GRAVITY * up / np.linalg.norm(up) + fixed[4:]
    place = found[:3] - fixed[:3]
    place[2] = found[2]  # level ground: both soles are at one height
    return np.concatenate([place, normal[:2], [found[3] - fixed[3]], force - expected])
