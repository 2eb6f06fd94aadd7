"""A bound on the ZMP's velocity."""

from __future__ import annotations

from collections.abc import Hashable
from copy import copy
from typing import ClassVar

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.terms.program import AxisProgram
from pdhocbf_drake.mpc.terms.term import RowKind, Setting, Term


class ZmpVelocity(Term):
    """|u(k+i)| ≤ u_max, i = 0 … H − 1, with u_max = `mpc.zmp_velocity_max` along this axis [m/s].

    On the relaxed rung it is left out: a ZMP that hurries is better than one outside its box.
    """

    rows: ClassVar = {"zmp_velocity": RowKind("tick", missed_as="zmp_velocity", unit="m/s")}
    axes_alike = True

    def __init__(self, setting: Setting) -> None:
        super().__init__(setting)
        most = setting.config.zmp_velocity_max
        self._most = None if most is None else most[setting.axis]

    @classmethod
    def configured(cls, config: MpcConfig) -> bool:
        return config.zmp_velocity_max is not None

    @property
    def key(self) -> Hashable:
        return super().key, self._most

    def write(self, program: AxisProgram) -> None:
        if self._most is None:
            return
        eye, lower = np.eye(program.horizon), np.full(program.horizon, -self._most)
        for sign in (1.0, -1.0):
            program.at_least(sign * eye, program.u, "zmp_velocity", lower)

    def relaxed(self) -> Term:
        other = copy(self)
        other._most = None
        return other


def least_zmp_velocity(boxes: np.ndarray, tick: float) -> np.ndarray:
    """The speed that a ZMP needs to stay in a moving box, per axis, shape (2,) [m/s].

    The largest distance between the boxes of two ticks, divided by the time between them; along a line that is enough.

    Args:
        boxes: [low, high] per axis at successive ticks, shape (T, 2, 2) [m].
        tick: δ [s].
    """
    low, high = boxes[:, :, 0], boxes[:, :, 1]
    least = np.zeros(2)
    for apart in range(1, len(boxes)):
        gap = np.maximum(low[apart:] - high[:-apart], low[:-apart] - high[apart:])
        least = np.maximum(least, gap.max(axis=0) / (apart * tick))
    return least


def check_zmp_velocity(config: MpcConfig, boxes: np.ndarray, tick: float) -> None:
    """Refuses a bound that the moving box of a walk does not allow; arguments as in `least_zmp_velocity`.

    Raises:
        InputError: `mpc.zmp_velocity_max` is below what the box demands.
    """
    margin = np.array([config.zmp_margin, -config.zmp_margin])
    least = least_zmp_velocity(boxes + margin, tick)
    given = config.zmp_velocity_max
    if given is not None and np.any(np.array(given) < least):
        x, y = np.ceil(1e3 * least) / 1e3
        raise InputError(
            f"mpc.zmp_velocity_max: the ZMP box moves from foot to foot at up to [{x:g}, {y:g}] m/s in x and y, which "
            f"is the least that is possible (given: {list(given)})"
        )
