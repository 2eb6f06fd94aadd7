"""A barrier on a quantity of a walk: how the walk's stance feet, its start and its end enter it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.barriers import AffineBarrier, Bound, ClassK
from pdhocbf_drake.walking.barrier_changes import BarrierSettings, Setting
from pdhocbf_drake.walking.barrier_config import WalkBarrierConfig
from pdhocbf_drake.walking.commands import Command
from pdhocbf_drake.walking.gait import Gait
from pdhocbf_drake.walking.quantities import Quantity, stance_sides
from pdhocbf_drake.walking.vhip import Vhip

Array = NDArray[np.float64]

STARTING_STEPS = 4
"""Steps from the first swing on until a walk follows its orbit."""
ENDING_STEPS = 2
"""Last swings of a walk, in which it leaves its orbit."""


class CommandOrbits(NamedTuple):
    """The orbits from which V̄ of a walk that follows commands is made.

    Attributes:
        of: the walk under a constant command, settled: s = [c, v, p] from the stance foot and along its heading, of
            steps on the left and on the right foot, shape (2 feet, 2 axes, N, 3); None where there is none.
        margin: of a bound that follows the orbit, its distance from that [unit of h]; None for one that does not.
        peak: whether the bound follows the orbit's extreme value instead.
        expect: makes a part of `of` for a command that will be taken up.
    """

    of: Callable[[Command], Array | None]
    margin: float | None = None
    peak: bool = False
    expect: Callable[[Command], None] = lambda command: None


class BoundChanges(NamedTuple):
    """How the bound of one barrier changes while the walk goes on.

    Attributes:
        settings: of all barriers of the walk.
        place: of this one among them.
        barrier: the barrier with the bound of a setting.
    """

    settings: BarrierSettings
    place: int
    barrier: Callable[[Setting], WalkBarrier]

    def at(self, tick: int) -> Setting:
        """The barrier's setting at tick k."""
        return self.settings.at(tick)[self.place]


class WalkBarrier(AffineBarrier):
    """h(k, s) = ±(V̄(k) − σ_j n_k·s) for s = [c, v, p] of one axis as the quantity sees it, see `Quantity`.

    In the world, with the stance foot at f_j, that is ±(V̄(k) + g_k f_j − σ_j n_k·s), where g_k is `foot_gains`: a
    coming foothold adds to the bound. In the ψ rows of a plan it is a decision, from its touchdown on.

    Attributes:
        quantity: the bounded quantity.
        at_rest: whether V̄ is widened to hold at rest while the walk starts and ends, see `BoundSamples`.
        orbits: of a walk that follows commands, see `CommandedBound`; None elsewhere.
        changes: of its bound, see `ChangingBound`; None where it has none.
    """

    changes: BoundChanges | None = None

    def __init__(
        self,
        name: str,
        quantity: Quantity,
        normals: Array,
        bound: Bound,
        sign: int,
        class_k: Sequence[ClassK | float],
        unit: str = "",
        relative_degree: int | None = None,
        at_rest: bool = False,
        orbits: CommandOrbits | None = None,
    ) -> None:
        super().__init__(name, normals, bound, sign, class_k, unit or quantity.unit, relative_degree)
        self.quantity, self.at_rest, self.orbits = quantity, at_rest, orbits

    @property
    def from_stance(self) -> bool:
        """Whether c and p are seen from the stance foot."""
        return self.quantity.frame == "stance"

    @property
    def seen_anew(self) -> bool:
        """Whether h jumps where another foot becomes the stance, and the recursion starts again.

        So it is under commands for every quantity: the heading changes there, and V̄ goes over to another orbit.
        """
        return self.quantity.seen_anew or self.orbits is not None

    def foot_gains(self, k: int, count: int) -> Array:
        """g_k, …, g_{k+count−1}: what a metre of the stance foot's place adds to V̄, shape (count,)."""
        return np.asarray(self.normals(k, count) @ self.quantity.origin)

    def seen(self, state: Array, stance: float) -> Array:
        """[c, v, p] as the quantity sees it, from that in the world and the centre of the stance [m]."""
        return state - stance * self.quantity.origin


class BoundSamples:
    """V̄(k), …, V̄(k+n−1) of a barrier along a walk, from tables, since they are read at every tick.

    While a walk starts or ends there is no orbit. A `WalkBarrier` with `at_rest` then has the outer envelope of V̄ and
    of rest, max(V̄(k), q°) for an upper bound and min(V̄(k), q°) for a lower one, where q° is q in a stand seen from one
    foot: σ_j n_k·(0 − f) with the foot f at ± half the distance between the feet. That holds until `STARTING_STEPS`
    after the first swing, and from the last `ENDING_STEPS` swings on. In the stands themselves q is counted from the
    middle between both feet, and so is the bound: the envelope less q°. All other barriers have V̄ throughout.

    Steps in place of a stand count as swings. Where the feet stand the other way round than in earlier steps of the
    same parity (`Gait.flipped`), V̄ is that of the other parity.
    """

    def __init__(self, barrier: AffineBarrier, gait: Gait, count: int) -> None:
        self.period, self._count, self._gait = barrier.bound.period, count, gait
        self._settled = barrier.bound.samples(0, self.period + count)
        self._first, self._end = -np.inf, np.inf
        if not isinstance(barrier, WalkBarrier) or not barrier.at_rest:
            return
        n, cycle = gait.period, gait.config.ticks_per_gait
        sides = np.repeat(stance_sides(gait.config), n)
        across = gait.footsteps.width / 2.0 * (barrier.quantity.axis == 1)
        rest = -barrier.foot_gains(0, cycle) * sides * across
        outer = np.maximum if barrier.sign > 0 else np.minimum
        self._widened = outer(barrier.bound.samples(0, cycle), rest)
        self._standing = self._widened - rest
        self._swings = gait.config.start_steps * n, np.inf
        self._first = (gait.config.start_steps + STARTING_STEPS) * n
        last = gait.footsteps.last
        if last is not None:
            self._swings = self._swings[0], (last + 1) * n
            self._end = (last + 1 - ENDING_STEPS) * n

    def __call__(self, tick: int) -> Array:
        """V̄(k) … V̄(k+n−1), shape (n,)."""
        shift = self._gait.period * self._gait.flipped(tick // self._gait.period)
        place = (tick + shift) % self.period
        settled = self._settled[place : place + self._count]
        if self._first <= tick and tick + self._count <= self._end:
            return settled
        ticks, (begin, end), resumed = np.arange(tick, tick + self._count), self._swings, self._gait.footsteps.resumed
        in_gait = (ticks + shift) % len(self._widened)
        swinging = (ticks >= begin) & (ticks < end)
        if resumed.tick >= 0:
            swinging |= (ticks >= resumed.tick) & (ticks < (resumed.last + 1) * self._gait.period)
        swings = np.where(swinging, self._widened[in_gait], self._standing[in_gait])
        return np.where((ticks >= self._first) & (ticks < self._end), settled, swings)


def make_walk_barrier(
    name: str,
    config: WalkBarrierConfig,
    vhip: Vhip,
    gait: Gait,
    bound: Bound,
    at_rest: bool = False,
    orbits: CommandOrbits | None = None,
) -> WalkBarrier:
    """The barrier of a configuration with the given bound V̄(k)."""
    quantity, sign = config.bounded, 1 if config.side == "upper" else -1
    normals = quantity.normals_of(vhip, gait.config)
    return WalkBarrier(
        name, quantity, normals, bound, sign, config.make_class_k(), config.unit, config.relative_degree, at_rest,
        orbits,
    )  # fmt: skip
