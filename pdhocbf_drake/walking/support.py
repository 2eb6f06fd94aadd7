"""The support region: half sides of the ZMP box, its motion between two stances, its rows, and what it contains."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.walking.config import GaitConfig
from pdhocbf_drake.walking.kernels import write_box
from pdhocbf_drake.walking.sides import BOTH


class SupportRegion:
    """The box (27) in which the ZMP p is kept, |p − centre| ≤ half along x and along y.

    During the first D ticks of a step both feet are on the ground, and centre and half sides move linearly from those
    of the last step to those of this step. At tick q of step j:

        centre = (1 − w_q) centre_{j−1} + w_q centre_j,  half likewise,  w_q = min(1, (q + 1)/(D + 1))

    D = 0 is the paper's (27), a box that jumps in one tick. Values of steps j − 1, j, j + 1, … are in the order
    [last, this, coming …].

    Attributes:
        weight: w, the weight of this step's box, shape (N,).
        half_of_foot: half sides of the box on one foot, shape (2,) [m].
    """

    def __init__(self, config: GaitConfig) -> None:
        self._ticks = config.double_support_ticks + 1.0
        self.weight = self.share(np.arange(config.ticks_per_step))
        self.half_of_foot = np.array(config.zmp_box) / 2.0
        self._half_of_stand = self.half_of_foot + np.array([0.0, config.stance_width / 2.0])

    def share(self, ticks: np.ndarray) -> np.ndarray:
        """w_q at ticks of a step, 0 before its first one."""
        return np.clip((ticks + 1.0) / self._ticks, 0.0, 1.0)

    def half(self, side: int) -> np.ndarray:
        """Half sides of the box over a stance, shape (2,) [m]; on both feet wider by the distance between them."""
        return self._half_of_stand if side == BOTH else self.half_of_foot

    def weights(self, phase: int, horizon: int, footholds: int) -> np.ndarray:
        """S, shape (H, n_f + 2): from phase q on, the centre at k + i is S_i · [last, this, coming …], i = 1 … H.

        Args:
            phase: q. horizon: H [ticks]. footholds: n_f, the number of coming steps.
        """
        weights, samples = np.zeros((horizon, footholds + 2)), np.arange(horizon)
        ahead, tick = np.divmod(phase + 1 + samples, len(self.weight))
        weights[samples, ahead] = 1.0 - self.weight[tick]
        weights[samples, ahead + 1] = self.weight[tick]
        return weights

    def rows(self, phase: int, horizon: int, footholds: int) -> list[tuple[float, np.ndarray, np.ndarray]]:
        """(s, C, S) of the lower and of the upper sides: s · p_{k+i} + C_i · centres + S_i · half ≥ 0, i = 1 … H.

        The arguments are those of `weights`; C and S have shape (H, n_f + 2).
        """
        weights = self.weights(phase, horizon, footholds)
        return [(sign, -sign * weights, weights) for sign in (1.0, -1.0)]

    def box(
        self, phase: int, stance: np.ndarray, footholds: np.ndarray, half: np.ndarray, margin: float = 0.0
    ) -> np.ndarray:
        """The box at tick k + 1 of a plan from phase q: x_min, x_max, then y, shape (2, 2) [m].

        Args:
            phase: q.
            stance: centres of the last and of this step's box per axis, shape (2, 2) [m].
            footholds: centres of the coming ones per axis, shape (2, n_f) [m].
            half: half sides [last, this, coming …] per axis, shape (2, n_f + 2) [m].
            margin: added to the half sides [m].
        """
        ahead, tick = divmod(phase + 1, len(self.weight))
        box = np.empty((2, 2))
        write_box(ahead, self.weight[tick], stance, footholds, half, margin, box)
        return box

    def centres(self, stances: np.ndarray, ticks: int) -> np.ndarray:
        """Centre of the box along one axis, from the first tick of step j on, shape (ticks,) [m].

        Args:
            stances: centres of the stances of steps j − 1, j, j + 1, …, shape (n,) [m], n > ticks/N + 1.
            ticks: how many.
        """
        ahead, tick = np.divmod(np.arange(ticks), len(self.weight))
        weight = self.weight[tick]
        return (1.0 - weight) * stances[ahead] + weight * stances[ahead + 1]


def contains(box: np.ndarray, zmp: np.ndarray, tolerance: float = 0.0) -> np.ndarray:
    """Whether each ZMP (…, 2) lies in its box (…, 2 axes, 2 limits), widened by a tolerance on all sides [m]; (…)."""
    inside = (zmp >= box[..., 0] - tolerance) & (zmp <= box[..., 1] + tolerance)
    return np.asarray(inside.all(axis=-1))
