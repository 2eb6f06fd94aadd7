"""The periodic MPC as a block with a discrete update."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues

from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.loop import Measurement, control
from pdhocbf_drake.mpc.memory import OUTPUTS, Memory, MemoryLayout
from pdhocbf_drake.systems.block import Block
from pdhocbf_drake.systems.signals import size


class MpcController(Block):
    """Solves (36) at every tick kδ; its outputs are then what is planned for tick k + 1.

    All it remembers (the last plan, the feet on the ground, the active sets) is discrete state, laid out by
    `Memory`, so that a context can be copied, reset and replayed.

    Input ports:
        gait_phase (3): as in `systems.signals`; where it is left unconnected, the tick is time/δ.
        lip_state (6): as in `systems.signals`.
        barrier_bound (n_b (H + 1)): the bounds, where there are barriers; where it is left unconnected, the barriers'
            own.
        zmp_offset (2 H): expected real minus template ZMP, x then y; may be left unconnected.
        command (4): of a walk that follows commands, in place of those of the scenario: velocity ahead and to the left
            [m/s], turn rate [rad/s], and 1 for a stop or 0; may be left unconnected. It is taken up at the next
            touchdown, and limited to what the robot can do. Where one of the numbers is not finite, as of a sender that
            is late, the last command holds on.
        foot_state (12): measured soles; where it is connected, a foot that lands is taken to be where it is measured.
    Output parts, see `unbundled`:
        com_reference (6), zmp_reference (4), zmp_box (4), stance_plan (8), foot_plan (8), solver_status (6),
        barrier_slack (n_b), barrier_active (n_b), unmet (2 n_c): as in `systems.signals`, of the plan made at tick k.
        last_step (1): the step after which the walk comes to a stand, else −1.
        resumed (3): the steps that it takes in place of a stand, as in `systems.signals`.
        course (47): of a walk that follows commands, likewise.

    Attributes:
        mpc: the compiled problem.

    Args:
        initial: [c, v, p] per axis at the start, shape (2, 3).
        feet: left and right foot at the start, shape (2, 2) [m].
        barriers: (axis, name) in the order of the barrier_bound port.
        latency: from a measurement to the effect of what is planned from it, see `joint_targets.LATENCY` [s].
    """

    def __init__(
        self,
        mpc: PeriodicMpc,
        initial: np.ndarray,
        feet: np.ndarray,
        barriers: Sequence[tuple[int, str]],
        latency: float = 0.0,
    ) -> None:
        super().__init__()
        self._layout, self.latency = MemoryLayout(mpc), latency
        outputs = (*OUTPUTS, "last_step", "resumed", *["course"] * mpc.gait.turns)
        self.parts = {name: self._layout.sizes[name] for name in outputs}
        self.mpc, self._names = mpc, [name for _, name in barriers]
        # A plan has the barriers of x before those of y: where it has each one of ours.
        columns = np.argsort(np.argsort([axis for axis, _ in barriers], kind="stable"))
        self._columns = slice(None) if np.array_equal(columns, np.arange(len(columns))) else columns
        count, horizon = len(barriers), mpc.config.horizon
        self._phase = self.DeclareVectorInputPort("gait_phase", size("gait_phase"))
        self._lip = self.DeclareVectorInputPort("lip_state", size("lip_state"))
        if barriers:
            self._bounds = self.DeclareVectorInputPort("barrier_bound", size("barrier_bound", count, horizon))
        self._offset = self.DeclareVectorInputPort("zmp_offset", size("zmp_offset", horizon=horizon))
        self._feet = self.DeclareVectorInputPort("foot_state", size("foot_state"))
        self._command = self.DeclareVectorInputPort("command", 4) if mpc.gait.turns else None
        memory = Memory.at_start(mpc, initial, feet)
        start = self._layout.pack(memory)
        # The last memory with its bytes: where the state holds these, it need not be taken apart.
        self._packed = start[self._layout.carried].tobytes(), memory
        self.DeclareStateOutputPort("memory", self.DeclareDiscreteState(start))
        self.DeclarePeriodicDiscreteUpdateEvent(mpc.gait.config.tick, 0.0, self._update)

    def memory(self, context: Context) -> Memory:
        """What the controller remembers before its update, in a context of this block."""
        carried = context.get_discrete_state_vector().value()[self._layout.carried]
        packed, memory = self._packed
        return memory if carried.tobytes() == packed else self._layout.unpack_carried(carried)

    def measurement(self, context: Context) -> Measurement:
        """What the controller is given at the tick of a context of this block."""
        feet = self._feet.Eval(context).reshape(2, 6)[:, :2] if self._feet.HasValue(context) else None
        offset = self._offset.Eval(context).reshape(2, -1) if self._offset.HasValue(context) else None
        bounds = None
        if self._names and self._bounds.HasValue(context):
            samples = self._bounds.Eval(context).reshape(len(self._names), -1)
            bounds = dict(zip(self._names, samples, strict=True))
        state = self._lip.Eval(context).reshape(2, 3)
        command = None
        if self._command is not None and self._command.HasValue(context):
            command = self._command.Eval(context)
        return Measurement(self._tick(context), state, feet, offset, bounds, command)

    def _tick(self, context: Context) -> int:
        gait = self.mpc.gait
        if not self._phase.HasValue(context):
            return round(context.get_time() / gait.config.tick)
        phase, step, _ = self._phase.Eval(context).tolist()
        return round(step * gait.period + phase)

    def _update(self, context: Context, values: DiscreteValues) -> None:
        started = time.perf_counter()
        memory, plan = control(self.mpc, self.memory(context), self.measurement(context), self.latency)
        memory.barrier_slack, memory.barrier_active = plan.slacks[self._columns], plan.acting[self._columns]
        memory.solver_status[1] = time.perf_counter() - started
        vector = self._layout.pack(memory)
        values.set_value(vector)
        self._packed = vector[self._layout.carried].tobytes(), memory
