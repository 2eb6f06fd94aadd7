"""The barriers' bounds over the coming horizon, and h on the measured state."""

from __future__ import annotations

from collections.abc import Sequence
from math import lcm

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from pdhocbf_drake.barriers import AffineBarrier
from pdhocbf_drake.systems.kernels import write_h
from pdhocbf_drake.systems.signals import places, size, sizes
from pdhocbf_drake.walking.frame import rotation

(_YAW,) = places("path", "yaw")


class BarrierSchedule(LeafSystem):
    """Outputs the periodic bounds V̄(k) of n_b barriers over the horizon H, and h.

    Input ports:
        gait_phase (3), lip_state (6): as in `systems.signals`.
        path (7): likewise, of a walk that turns: h is then seen along the heading of the stance foot.
    Output parts, see `unbundled`:
        barrier_bound (n_b (H + 1)): V̄(k) … V̄(k + H), barrier after barrier [unit of the barrier].
        h (n_b): each barrier on the measured state, eq. (25) [unit of the barrier].

    Args:
        axes: 0 (x) or 1 (y) for each barrier.
        barriers: their normals act on [c, v, p] of that axis.
        ticks_per_step: N, to count ticks from step and phase.
        horizon: H [ticks].
        turns: whether the walk may turn.
    """

    def __init__(
        self, axes: Sequence[int], barriers: Sequence[AffineBarrier], ticks_per_step: int, horizon: int,
        turns: bool = False,
    ) -> None:  # fmt: skip
        super().__init__()
        self.parts = sizes("barrier_bound", "h", barriers=len(barriers), horizon=horizon)
        self._barriers = tuple(barriers)
        self._n, self._count = ticks_per_step, horizon + 1
        for barrier in barriers:
            barrier.check_fits(3)  # the kernel checks no index
        # One period and a horizon of each bound, so that the samples from any tick on are one slice.
        self._samples = [b.bound.samples(0, b.bound.period + self._count) for b in self._barriers]
        self._signs = np.array([float(b.sign) for b in self._barriers])
        self._axes, cycle = np.array(axes), lcm(*(b.normal_period for b in self._barriers))
        self._normals = np.stack([b.normals(0, cycle) for b in self._barriers], axis=1)  # (cycle, n_b, 3)
        self._phase = self.DeclareVectorInputPort("gait_phase", size("gait_phase"))
        self._lip = self.DeclareVectorInputPort("lip_state", size("lip_state"))
        prerequisites = {self._phase.ticket(), self._lip.ticket()}
        self._path = self.DeclareVectorInputPort("path", size("path")) if turns else None
        if self._path is not None:
            prerequisites.add(self._path.ticket())
        self.DeclareVectorOutputPort("bounds_and_h", sum(self.parts.values()), self._calc, prerequisites)

    def _calc(self, context: Context, output: BasicVector) -> None:
        phase, step, _ = self._phase.Eval(context).tolist()
        tick, count = round(step * self._n + phase), self._count
        starts = [tick % barrier.bound.period for barrier in self._barriers]
        bounds = [samples[i : i + count] for i, samples in zip(starts, self._samples, strict=True)]
        values = np.concatenate([*bounds, self._signs])  # the signs are overwritten with h
        normals = self._normals[tick % len(self._normals)]
        state = self._lip.Eval(context)
        if self._path is not None:
            state = (rotation(-self._path.Eval(context)[_YAW]) @ state.reshape(2, 3)).ravel()
        write_h(self._signs, self._axes, normals, count, state, values)
        output.SetFromVector(values)
