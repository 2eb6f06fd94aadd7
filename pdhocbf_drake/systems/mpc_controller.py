"""The periodic MPC as a block with a discrete update."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues

from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.kernels import same_bits
from pdhocbf_drake.mpc.loop import Measurement, control
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.memory_layout import OUTPUTS, MemoryLayout
from pdhocbf_drake.systems.block import Block
from pdhocbf_drake.systems.optional_input import OptionalInput
from pdhocbf_drake.systems.signals import size

_SOLES = np.array([[0, 1, 5], [6, 7, 11]])  # in foot_state, where each sole is along the ground, and its yaw


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
            touchdown, in the last eighth of a step, unless it stops, at the one after that, and limited to what the
            robot can do. Where one of the numbers is not finite, as of a late sender, the last command holds on.
        foot_state (12): measured soles; where it is connected, a foot that lands is taken to be where it is measured.
        landing_delay (1): ticks by which the stance foot has come to the ground late; may be left unconnected.
    Output parts, see `unbundled`:
        com_reference (6), zmp_reference (4), zmp_box (4), stance_plan (8), foot_plan (8), solver_status (6),
        barrier_slack (n_b), barrier_active (n_b), unmet (2 n_c): as in `systems.signals`, of the plan made at tick k.
        input_disturbance (4): as in `systems.signals`.
        last_step (1): the step after which the walk comes to a stand, else −1.
        resumed (3): the steps that it takes in place of a stand, as in `systems.signals`.
        course (48): of a walk that follows commands, likewise.

    Attributes:
        mpc: the compiled problem.
        layout: how a memory lies in the state.
        start: the memory at the start as a vector and as itself.

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
        self.layout, self.latency = MemoryLayout(mpc), latency
        outputs = (*OUTPUTS, "input_disturbance", "last_step", "resumed", *["course"] * mpc.gait.turns)
        self.parts = {name: self.layout.sizes[name] for name in outputs}
        self.mpc, samples = mpc, mpc.config.horizon + 1
        self._places = [(name, slice(i * samples, (i + 1) * samples)) for i, (_, name) in enumerate(barriers)]
        # A plan has the barriers of x before those of y: where it has each one of ours.
        columns = np.argsort(np.argsort([axis for axis, _ in barriers], kind="stable"))
        self._columns = slice(None) if np.array_equal(columns, np.arange(len(columns))) else columns
        count, horizon = len(barriers), mpc.config.horizon
        self._phase = self._optional("gait_phase", size("gait_phase"))
        self._lip = self.DeclareVectorInputPort("lip_state", size("lip_state"))
        self._bounds = self._optional("barrier_bound", size("barrier_bound", count, horizon)) if barriers else None
        self._offset = self._optional("zmp_offset", size("zmp_offset", horizon=horizon))
        self._feet = self._optional("foot_state", size("foot_state"))
        self._command = self._optional("command", 4) if mpc.gait.turns else None
        self._late = self._optional("landing_delay", size("landing_delay"))
        memory = Memory.at_start(mpc, initial, feet)
        start = self.layout.pack(memory)
        # The last memory with its vector: where the state is that one, it need not be taken apart.
        self.start = self._last = start, memory
        self.DeclareStateOutputPort("memory", self.DeclareDiscreteState(start))
        self.DeclarePeriodicDiscreteUpdateEvent(mpc.gait.config.tick, 0.0, self._update)

    def _optional(self, name: str, elements: int) -> OptionalInput:
        return OptionalInput(self.DeclareVectorInputPort(name, elements))

    def memory(self, context: Context) -> Memory:
        """What the controller remembers before its update, in a context of this block."""
        state, (vector, memory) = context.get_discrete_state_vector().value(), self._last
        return memory if same_bits(state, vector) else self.layout.unpack_carried(state[self.layout.carried])

    def measurement(self, context: Context) -> Measurement:
        """What the controller is given at the tick of a context of this block."""
        bounds = None if self._bounds is None else self._bounds(context)
        command = None if self._command is None else self._command(context)
        lip, late = self._lip.Eval(context), self._late(context)
        feet, offset = self._feet(context), self._offset(context)
        return self.measured(self._tick(context), lip, feet, offset, bounds, command, late)

    def measured(
        self, tick: int, lip: np.ndarray, feet: np.ndarray | None, offset: np.ndarray | None,
        bounds: np.ndarray | None, command: np.ndarray | None, late: np.ndarray | None,
    ) -> Measurement:  # fmt: skip
        """The measurement of a tick from the values of the ports."""
        feet = None if feet is None else feet.take(_SOLES)
        offset = None if offset is None else offset.reshape(2, -1)
        named = None if bounds is None else {name: bounds[place] for name, place in self._places}
        delay = 0.0 if late is None else float(late[0])
        return Measurement(tick, lip.reshape(2, 3), feet, offset, named, command, delay)

    def _tick(self, context: Context) -> int:
        gait, given = self.mpc.gait, self._phase(context)
        if given is None:
            return round(context.get_time() / gait.config.tick)
        phase, step, _ = given.tolist()
        return round(step * gait.period + phase)

    def _update(self, context: Context, values: DiscreteValues) -> None:
        started = time.perf_counter()
        memory = self.planned(self.memory(context), self.measurement(context), started)
        vector, _ = self._last = self.layout.pack(memory), memory
        values.set_value(vector)

    def planned(self, memory: Memory, measurement: Measurement, started: float) -> Memory:
        """The next memory after a tick whose time is counted from `started` [s]."""
        memory, plan = control(self.mpc, memory, measurement, self.latency)
        memory.barrier_slack, memory.barrier_active = plan.slacks[self._columns], plan.acting[self._columns]
        memory.solver_status[1] = time.perf_counter() - started
        return memory
