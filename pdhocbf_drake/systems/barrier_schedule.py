"""The barriers' bounds over the coming horizon, and h on the measured state."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from pdhocbf_drake.barriers import AffineBarrier


class BarrierSchedule(LeafSystem):
    """Plays the periodic bounds V̄(k) of velocity barriers to the controller.

    Input ports:
        gait_phase (3), lip_state (6): as in `simulation.signals`.
    Output ports:
        velocity_bound (n_b (H + 1)): V̄(k) … V̄(k + H), barrier after barrier [m/s].
        h (n_b): each barrier at the measured velocity, eq. (25) [m/s].

    Args:
        axes: 0 (x) or 1 (y) for each barrier.
        barriers: their normals act on [c, v, p] of that axis.
        ticks_per_step: N, to count ticks from step and phase.
        horizon: H [ticks].
    """

    def __init__(
        self, axes: Sequence[int], barriers: Sequence[AffineBarrier], ticks_per_step: int, horizon: int
    ) -> None:
        super().__init__()
        self._axes, self._barriers = tuple(axes), tuple(barriers)
        self._n, self._horizon = ticks_per_step, horizon
        phase = self.DeclareVectorInputPort("gait_phase", 3)
        lip = self.DeclareVectorInputPort("lip_state", 6)
        count = len(self._barriers)
        self.DeclareVectorOutputPort("velocity_bound", count * (horizon + 1), self._bounds, {phase.ticket()})
        self.DeclareVectorOutputPort("h", count, self._h, {phase.ticket(), lip.ticket()})

    def _tick(self, context: Context) -> int:
        tick, step, _ = self.GetInputPort("gait_phase").Eval(context)
        return round(step * self._n + tick)

    def _bounds(self, context: Context, output: BasicVector) -> None:
        tick = self._tick(context)
        output.SetFromVector(np.concatenate([b.bound.samples(tick, self._horizon + 1) for b in self._barriers]))

    def _h(self, context: Context, output: BasicVector) -> None:
        tick, state = self._tick(context), self.GetInputPort("lip_state").Eval(context).reshape(2, 3)
        output.SetFromVector([b.h(tick, state[axis]) for axis, b in zip(self._axes, self._barriers, strict=True)])
