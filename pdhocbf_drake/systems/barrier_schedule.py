"""The barriers' bounds over the coming horizon, and h on the measured state."""

from __future__ import annotations

from collections.abc import Sequence
from math import lcm

import numpy as np
from pydrake.systems.framework import BasicVector, Context, InputPort

from pdhocbf_drake.barriers import AffineBarrier
from pdhocbf_drake.kept import Kept
from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.systems.gait_reference import ChangedGait
from pdhocbf_drake.systems.kernels import write_h
from pdhocbf_drake.systems.signals import places, size, sizes
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.bound_samples import Samples, bound_samples
from pdhocbf_drake.walking.frame import rotation
from pdhocbf_drake.walking.walk_barrier import WalkBarrier

(_YAW,) = places("path", "yaw")
_WALKS = 8  # whose bounds are kept: the commanded one, and those that a controller has changed
_NOW = places("stance_plan", "x_now", "y_now")


class BarrierSchedule(Block):
    """Outputs the periodic bounds V̄(k) of n_b barriers over the horizon H, and h.

    Input ports:
        gait_phase (3), lip_state (6): as in `systems.signals`.
        path (7): likewise, of a walk that turns: h is then seen along the heading of the stance foot.
        stance_plan (8): likewise; only where a barrier bounds a quantity that is seen from the stance foot.
        those of `ChangedGait`: the bound is that of the walk as it is really walked.
    Output parts, see `unbundled`:
        barrier_bound (n_b (H + 1)): V̄(k) … V̄(k + H), barrier after barrier [unit of the barrier].
        h (n_b): each barrier on the measured state, eq. (25) [unit of the barrier].

    Args:
        axes: 0 (x) or 1 (y) for each barrier.
        barriers: their normals act on [c, v, p] of that axis.
        gait: the walk, to count ticks from step and phase and to see where it starts and ends.
        horizon: H [ticks].
    """

    def __init__(self, axes: Sequence[int], barriers: Sequence[AffineBarrier], gait: Gait, horizon: int) -> None:
        super().__init__()
        self.parts = sizes("barrier_bound", "h", barriers=len(barriers), horizon=horizon)
        self._n, self._count = gait.period, horizon + 1
        for barrier in barriers:
            barrier.check_fits(3)  # the kernel checks no index
        self._barriers, self._samples = barriers, Kept[list[Samples]](_WALKS)
        self._gait = ChangedGait(self, gait)
        self._signs = np.array([float(b.sign) for b in barriers])
        self._axes, cycle = np.array(axes), lcm(*(b.normal_period for b in barriers))
        self._normals = np.stack([b.normals(0, cycle) for b in barriers], axis=1)  # (cycle, n_b, 3)
        self._phase = self.DeclareVectorInputPort("gait_phase", size("gait_phase"))
        self._lip = self.DeclareVectorInputPort("lip_state", size("lip_state"))
        prerequisites = {self._phase.ticket(), self._lip.ticket(), *self._gait.tickets}
        self._path = self.DeclareVectorInputPort("path", size("path")) if gait.turns else None
        if self._path is not None:
            prerequisites.add(self._path.ticket())
        # Which of x and y is the stance's place that each barrier sees; the last of three numbers, 0, for none.
        self._seen_from, self._on_ground = np.full(len(barriers), 2), np.zeros(len(barriers))
        self._stance: InputPort | None = None
        for i, barrier in enumerate(barriers):
            if isinstance(barrier, WalkBarrier) and barrier.from_stance:
                self._seen_from[i] = axes[i]
        if np.any(self._seen_from < 2):
            self._stance = self.DeclareVectorInputPort("stance_plan", size("stance_plan"))
            prerequisites.add(self._stance.ticket())
        self.DeclareVectorOutputPort("bounds_and_h", sum(self.parts.values()), weakly(self._calc), prerequisites)

    def _calc(self, context: Context, output: BasicVector) -> None:
        phase, step, _ = self._phase.Eval(context).tolist()
        tick, gait = round(step * self._n + phase), self._gait(context)
        values = np.concatenate([*self.bounds(tick, gait), self._signs])
        bounds, h = values[: -len(self._signs)], values[-len(self._signs) :]
        stance = None if self._stance is None else self._stance.Eval(context)
        path = None if self._path is None else self._path.Eval(context)
        self.write_h(tick, gait, self._lip.Eval(context), stance, path, bounds, h)
        output.SetFromVector(values)

    def bounds(self, tick: int, gait: Gait) -> list[np.ndarray]:
        """The bound of each barrier at tick k of the gait as it has been changed, (H + 1,)."""
        count = self._count
        bounds = self._samples.get(gait, lambda: [bound_samples(barrier, gait, count) for barrier in self._barriers])
        return [samples(tick) for samples in bounds]

    def write_h(
        self, tick: int, gait: Gait, state: np.ndarray, stance: np.ndarray | None, path: np.ndarray | None,
        bounds: np.ndarray, h: np.ndarray,
    ) -> None:  # fmt: skip
        """Writes h at tick k.

        Args:
            state: lip_state. stance: stance_plan, where the block has that port. path: of a walk that turns.
            bounds: barrier_bound. h: (n_b,).
        """
        normals = self._normals[(tick + self._n * gait.flipped(tick // self._n)) % len(self._normals)]
        stances = self._on_ground
        here = None if self._stance is None or stance is None else stance[_NOW]
        if path is not None:
            seen = rotation(-path[_YAW])
            state, here = (seen @ state.reshape(2, 3)).ravel(), None if here is None else seen @ here
        if here is not None:
            stances = np.append(here, 0.0)[self._seen_from]
        write_h(self._signs, self._axes, normals, stances, state, bounds, h)
