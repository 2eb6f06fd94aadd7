"""The quantities of a walk that a barrier can bound: scalars n_k·[c, v, p] of one axis of the template.

`QUANTITIES` holds them by name. What is linear in CoM, CoM velocity and ZMP of one axis is one more entry there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pdhocbf_drake.barriers.config import Side
from pdhocbf_drake.walking.config import GaitConfig

if TYPE_CHECKING:  # the template's kernels load numba
    from pdhocbf_drake.walking.vhip import Vhip

Array = NDArray[np.float64]
Axis = Literal["x", "y"]
QuantityName = Literal[
    "forward_speed", "lateral_speed", "com_x", "com_y", "dcm_x", "dcm_y", "zmp_x", "zmp_y"
]  # fmt: skip

_ANY_TICK = 0.01  # [s]; the relative degree depends neither on the tick nor on eta
_ANY_ETA = np.array([15.0, 17.0])  # [1/s²]


@dataclass(frozen=True)
class Quantity:
    """q(k) = σ_j n_k·s(k) with s = [c, v, p] (CoM [m], CoM velocity [m/s], ZMP [m]) on one axis of a walk.

    c and p are taken from the stance foot of step j where the quantity is a position. Along the heading σ_j = 1; a
    mirrored quantity across the heading is counted towards the other foot: σ_j = −1 on a left stance and +1 on a right
    one, so that in a straight walk it repeats after one step. In a stand σ_j goes on alternating, and c and p are taken
    from the middle between both feet. Its barrier is h(k) = ±(V̄(k) − q(k)), eq. (25).

    Attributes:
        name: its key in `QUANTITIES`.
        label: its name in sentences and on the axes of figures.
        axis: 0 (x) or 1 (y).
        normals: gives n_0, …, n_{P−1}, shape (P, 3), of a template; n_{k+P} = n_k, where P divides the
            ticks of a step and is 1 for a constant normal.
        frame: the origin of c and p, and so of q and V̄: the world's, or the stance foot.
        unit: unit of q, V̄ and h.
        steps: period of n_k·s(k) in the nominal walk, before it is mirrored [steps].
        largest: the largest |V̄(k)| that a barrier may have [unit].
        mirrored: whether it is counted towards the other foot.
    """

    name: str
    label: str
    axis: int
    normals: Callable[[Vhip], Array]
    frame: Literal["world", "stance"]
    unit: str
    steps: int
    largest: float
    mirrored: bool = False

    def period(self, ticks_per_step: int) -> int:
        """The period of q in the nominal walk [ticks]."""
        return (1 if self.mirrored else self.steps) * ticks_per_step

    def signs(self, gait: GaitConfig) -> tuple[float, float]:
        """σ_j of even and of odd steps."""
        even, odd = stance_sides(gait)
        return (-even, -odd) if self.mirrored else (1.0, 1.0)

    def normals_of(self, vhip: Vhip, gait: GaitConfig) -> Array:
        """σ_j n_k, shape (P, 3), or (2N, 3) for a mirrored quantity."""
        normals = self.normals(vhip)
        if not self.mirrored:
            return normals
        step = np.tile(normals, (vhip.period // len(normals), 1))
        return np.concatenate([sign * step for sign in self.signs(gait)])

    def values(
        self, states: ArrayLike, ticks: ArrayLike, vhip: Vhip, gait: GaitConfig, stance: ArrayLike = 0.0
    ) -> Array:
        """q(k) from s(k) of its axis in the world, shape (T, 3), at the ticks k, shape (T,).

        Args:
            states: s(k). ticks: k. vhip: the template. gait: the walk.
            stance: centre of the stance on this axis at each tick, shape (T,) [m]; of no effect on a speed.
        """
        normals = self.normals_of(vhip, gait)
        seen = np.asarray(states) - np.multiply.outer(stance, self.origin)
        return np.asarray((normals[np.asarray(ticks) % len(normals)] * seen).sum(axis=1))

    @property
    def origin(self) -> Array:
        """What the stance foot's place f adds to s: s − f·origin is s as the quantity sees it, shape (3,)."""
        return np.array([1.0, 0.0, 1.0]) * (self.frame == "stance")

    @property
    def seen_anew(self) -> bool:
        """Whether q jumps where another foot becomes the stance."""
        return self.frame == "stance" or self.mirrored

    def orbit(self, walk: ArrayLike, vhip: Vhip, gait: GaitConfig, side: Side = "upper") -> Array | None:
        """One period of q in the nominal walk; None for a position in the world, which advances from step to step.

        A periodic tail keeps a difference of left and right steps that the start has left, a millimetre or two. The
        orbit of a mirrored quantity is the outer one of both.

        Args:
            walk: s of both axes over a gait of the nominal walk that begins with an even step, c and p from the
                stance foot, shape (2, 2N, 3).
            vhip: the template. gait: the walk.
            side: of the bound that is drawn from the orbit.
        """
        if self.frame == "world" and np.any(self.normals(vhip)[:, [0, 2]]):
            return None
        states, period = np.asarray(walk)[self.axis], self.period(vhip.period)
        periods = self.values(states, np.arange(len(states)), vhip, gait).reshape(-1, period)
        if not self.mirrored:
            return periods[0]
        return np.asarray(periods.max(axis=0) if side == "upper" else periods.min(axis=0))

    @cached_property
    def relative_degree(self) -> int:
        """r: ticks after which the ZMP velocity acts on q, computed for the Euler flow (23)."""
        from pdhocbf_drake.barriers import AffineBarrier, constant
        from pdhocbf_drake.barriers.relative_degree import relative_degree
        from pdhocbf_drake.walking.vhip import Vhip

        vhip = Vhip(_ANY_ETA, _ANY_TICK)
        barrier = AffineBarrier(self.name, self.normals(vhip), constant(0.0), 1, [1.0])
        return max(r for k in range(vhip.period) if (r := relative_degree(barrier, vhip.system, k)) is not None)


def stance_sides(gait: GaitConfig) -> tuple[float, float]:
    """The stance foot of even and of odd steps, +1 left or −1 right; in a stand, were the feet to go on alternating."""
    left_is_even = (gait.first_stance == "left") == (gait.start_steps % 2 == 0)
    return (1.0, -1.0) if left_is_even else (-1.0, 1.0)


def _constant(normal: tuple[float, float, float]) -> Callable[[Vhip], Array]:
    return lambda vhip: np.array([normal])


def _divergent(vhip: Vhip) -> Array:
    """[1, 1/ω_k, 0]: ξ_k = c + v/ω_k, eq. (30)."""
    from pdhocbf_drake.walking.divergent import DivergentComponent

    omega = DivergentComponent(vhip).omega
    return np.column_stack([np.ones_like(omega), 1.0 / omega, np.zeros_like(omega)])


def _along(axis: int, name: str, label: str, normals: Callable[[Vhip], Array], unit: str) -> Quantity:
    """A quantity of one axis: along the heading it repeats every step, across it every gait, as the feet alternate."""
    speed = unit == "m/s"
    return Quantity(
        name, f"{label} in {'xy'[axis]}", axis, normals, "world" if speed else "stance", unit,
        steps=1 + axis, largest=1e3 if speed else 1e2,
    )  # fmt: skip


_VELOCITY: Final = _constant((0.0, 1.0, 0.0))
_KINDS: Final = (
    (("forward_speed", "lateral_speed"), "CoM velocity", _VELOCITY, "m/s"),
    (("com_x", "com_y"), "CoM from the stance foot", _constant((1.0, 0.0, 0.0)), "m"),
    (("dcm_x", "dcm_y"), "divergent component from the stance foot", _divergent, "m"),
    (("zmp_x", "zmp_y"), "ZMP from the stance foot", _constant((0.0, 0.0, 1.0)), "m"),
)  # fmt: skip

QUANTITIES: Final[dict[str, Quantity]] = {
    name: _along(axis, name, label, normals, unit)
    for names, label, normals, unit in _KINDS
    for axis, name in enumerate(names)
}

SPEEDS: Final = (QUANTITIES["forward_speed"], QUANTITIES["lateral_speed"])
"""The CoM velocity along x and along y."""
