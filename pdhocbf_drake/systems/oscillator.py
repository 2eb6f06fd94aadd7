"""The Van der Pol oscillator (16) as a plant, and the filter that keeps it in its tube (18)."""

from __future__ import annotations

import time

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.oscillator.van_der_pol_tube import VanDerPolTube

_REASONS = {"solved": Reason.SOLVED, "softened": Reason.SOFTENED, "failed": Reason.NOT_OPTIMAL}


class Oscillator(LeafSystem):
    """Eq. (16); steps half a tick after the filter, so that the input found at kδ acts from kδ on.

    Input ports:
        oscillator_input (1) [1/s²].
    Output ports:
        oscillator_state (2) [1, 1/s].
    """

    def __init__(self, tube: VanDerPolTube) -> None:
        super().__init__()
        self._system = tube.system
        self.DeclareVectorInputPort("oscillator_input", 1)
        state = self.DeclareDiscreteState(np.array(tube.config.initial_state))
        self.DeclarePeriodicDiscreteUpdateEvent(tube.config.tick, 0.5 * tube.config.tick, self._step)
        self.DeclareStateOutputPort("oscillator_state", state)

    def _step(self, context: Context, values: DiscreteValues) -> None:
        state = context.get_discrete_state_vector().value()
        values.set_value(self._system.step(0, state, self.GetInputPort("oscillator_input").Eval(context)))


class TubeFilter(LeafSystem):
    """u nearest to zero with ψ_m ≥ 0 for all four barriers. Discrete state: tick, u, status and slacks of the last one.

    Input ports:
        oscillator_state (2).
    Output ports:
        oscillator_input (1): found at the last tick [1/s²].
        h (4): x₁ upper, x₁ lower, x₂ upper, x₂ lower [1, 1, 1/s, 1/s].
        solver_status (6), barrier_slack (4): as in `simulation.signals`, slacks in the order and unit of h.
    """

    def __init__(self, tube: VanDerPolTube) -> None:
        super().__init__()
        self._tube = tube
        state = self.DeclareVectorInputPort("oscillator_state", 2).ticket()
        self.DeclareDiscreteState(np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, Reason.SOLVED, *np.zeros(4)]))
        self.DeclarePeriodicDiscreteUpdateEvent(tube.config.tick, 0.0, self._update)
        memory = {self.xd_ticket()}
        self.DeclareVectorOutputPort("oscillator_input", 1, self._input, memory)
        self.DeclareVectorOutputPort("h", 4, self._h, {state, self.xd_ticket()})
        self.DeclareVectorOutputPort("solver_status", 6, self._status, memory)
        self.DeclareVectorOutputPort("barrier_slack", 4, self._slack, memory)

    def _update(self, context: Context, values: DiscreteValues) -> None:
        started = time.perf_counter()
        memory = context.get_discrete_state_vector().value()
        tick = round(memory[0])
        found = self._tube.filter(tick, self.GetInputPort("oscillator_state").Eval(context), np.zeros(1))
        solved = float(found.status != "failed")
        fallbacks = 0.0 if solved else memory[6] + 1.0
        slacks = np.nan_to_num(found.slack)
        cost = float(found.input @ found.input)
        elapsed = time.perf_counter() - started
        status = (solved, elapsed, cost, slacks.max(), fallbacks, _REASONS[found.status])
        values.set_value([tick + 1, found.input[0], *status, *slacks])

    def _input(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state_vector().value()[1:2])

    def _status(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state_vector().value()[2:8])

    def _slack(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state_vector().value()[8:])

    def _h(self, context: Context, output: BasicVector) -> None:
        tick = round(context.get_discrete_state_vector()[0])
        state = self.GetInputPort("oscillator_state").Eval(context)
        output.SetFromVector([barrier.h(tick, state) for barrier in self._tube.barriers])
