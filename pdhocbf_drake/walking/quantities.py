"""The quantities of a walk that a barrier can bound: scalars n_k·[c, v, p] of one axis of the template.

`QUANTITIES` holds them by name. What is linear in CoM, CoM velocity and ZMP of one axis is one more entry there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:  # the template's kernels load numba
    from pdhocbf_drake.walking.vhip import Vhip

Array = NDArray[np.float64]
Axis = Literal["x", "y"]


@dataclass(frozen=True)
class Quantity:
    """q(k) = n_k·s(k) with s = [c, v, p] (CoM [m], CoM velocity [m/s], ZMP [m]) on one axis of a walk.

    Its barrier is h(k) = ±(V̄(k) − q(k)), eq. (25).

    Attributes:
        name: its key in `QUANTITIES`.
        label: its name in sentences and on the axes of figures.
        axis: 0 (x) or 1 (y).
        normals: gives n_0, …, n_{P−1}, shape (P, 3), of a template; n_{k+P} = n_k, where P divides the
            ticks of a step and is 1 for a constant normal.
        frame: the frame of c, v and p, and so of q and V̄.
        unit: unit of q, V̄ and h.
        steps: period of q in the nominal walk [steps].
        largest: the largest |V̄(k)| that a barrier may have [unit].
    """

    name: str
    label: str
    axis: int
    normals: Callable[[Vhip], Array]
    frame: Literal["world"]
    unit: str
    steps: int
    largest: float

    def period(self, ticks_per_step: int) -> int:
        """The period of q in the nominal walk [ticks]."""
        return self.steps * ticks_per_step

    def values(self, states: ArrayLike, ticks: ArrayLike, vhip: Vhip) -> Array:
        """q(k) from s(k) of its axis, shape (T, 3), at the ticks k, shape (T,)."""
        normals = self.normals(vhip)
        return np.asarray((normals[np.asarray(ticks) % len(normals)] * np.asarray(states)).sum(axis=1))

    def orbit(self, walk: ArrayLike, vhip: Vhip) -> Array | None:
        """One period of q in the nominal walk; None for a position, which in the world advances from step to step.

        Args:
            walk: s of both axes over a gait of the nominal walk that begins with an even step, shape (2, 2N, 3).
        """
        if np.any(self.normals(vhip)[:, [0, 2]]):
            return None
        period = self.period(vhip.period)
        return self.values(np.asarray(walk)[self.axis, :period], np.arange(period), vhip)


def _constant(normal: tuple[float, float, float]) -> Callable[[Vhip], Array]:
    return lambda vhip: np.array([normal])


# Forward motion repeats every step. Lateral motion repeats every gait, because the feet alternate.
_ENTRIES: Final = (
    Quantity(
        "forward_speed", "CoM velocity in x", axis=0, normals=_constant((0.0, 1.0, 0.0)), frame="world", unit="m/s",
        steps=1, largest=1e3,
    ),
    Quantity(
        "lateral_speed", "CoM velocity in y", axis=1, normals=_constant((0.0, 1.0, 0.0)), frame="world", unit="m/s",
        steps=2, largest=1e3,
    ),
)  # fmt: skip

QUANTITIES: Final[dict[str, Quantity]] = {quantity.name: quantity for quantity in _ENTRIES}

SPEEDS: Final = (QUANTITIES["forward_speed"], QUANTITIES["lateral_speed"])
"""The CoM velocity along x and along y."""
