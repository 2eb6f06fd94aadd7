"""The Van der Pol oscillator (16) as a plant, and the filter that keeps it in its tube (18)."""

from __future__ import annotations

import time

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.oscillator.van_der_pol_tube import VanDerPolTube
from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.systems.signals import places, size

(_FALLBACKS,) = places("solver_status", "fallbacks")
_AT_BOUND = 1e-6  # share of the largest |ψ| below which a ψ is at its bound
_REASONS = {"solved": Reason.SOLVED, "softened": Reason.SOFTENED, "failed": Reason.NOT_OPTIMAL}


class Oscillator(Block):
    """Eq. (16) as a discrete-time plant. It steps half a tick after the filter: the input found at kδ acts from kδ on.

    Input ports:
        oscillator_input (1) [1/s²].
    Output ports:
        oscillator_state (2) [1, 1/s].
    """

    def __init__(self, tube: VanDerPolTube) -> None:
        super().__init__()
        self._system = tube.system
        self._input = self.DeclareVectorInputPort("oscillator_input", size("oscillator_input"))
        state = self.DeclareDiscreteState(np.array(tube.config.initial_state))
        self.DeclarePeriodicDiscreteUpdateEvent(tube.config.tick, 0.5 * tube.config.tick, self._step)
        self.DeclareStateOutputPort("oscillator_state", state)

    def _step(self, context: Context, values: DiscreteValues) -> None:
        state = context.get_discrete_state_vector().value()
        values.set_value(self._system.step(0, state, self._input.Eval(context)))


class TubeFilter(Block):
    """u nearest to zero with ψ_m ≥ 0 for all four barriers.

    Its discrete state is the tick, and the input, the status and the slacks of the last one.

    Input ports:
        oscillator_state (2).
    Output ports:
        oscillator_input (1): found at the last tick [1/s²].
        h (4): x₁ upper, x₁ lower, x₂ upper, x₂ lower [1, 1, 1/s, 1/s].
        solver_status (6), barrier_slack (4), barrier_active (4): as in `systems.signals`; slacks have the order and
            units of h.
    """

    def __init__(self, tube: VanDerPolTube) -> None:
        super().__init__()
        self._tube = tube
        count = len(tube.barriers)
        self._state = self.DeclareVectorInputPort("oscillator_state", size("oscillator_state"))
        self._tick = self.DeclareDiscreteState(1)
        self._input = self.DeclareDiscreteState(np.zeros(size("oscillator_input")))
        self._status = self.DeclareDiscreteState(np.array([1.0, 0.0, 0.0, 0.0, 0.0, Reason.SOLVED]))
        self._slack = self.DeclareDiscreteState(np.zeros(size("barrier_slack", count)))
        self._active = self.DeclareDiscreteState(np.zeros(size("barrier_active", count)))
        self.DeclarePeriodicDiscreteUpdateEvent(tube.config.tick, 0.0, self._update)
        self.DeclareStateOutputPort("oscillator_input", self._input)
        h_changes_with = {self._state.ticket(), self.discrete_state_ticket(self._tick)}
        self.DeclareVectorOutputPort("h", size("h", count), weakly(self._calc_h), h_changes_with)
        self.DeclareStateOutputPort("solver_status", self._status)
        self.DeclareStateOutputPort("barrier_slack", self._slack)
        self.DeclareStateOutputPort("barrier_active", self._active)

    def _update(self, context: Context, values: DiscreteValues) -> None:
        started = time.perf_counter()
        tick = round(context.get_discrete_state(self._tick)[0])
        found = self._tube.filter(tick, self._state.Eval(context), np.zeros(1))
        solved = float(found.status != "failed")
        fallbacks = 0.0 if solved else context.get_discrete_state(self._status)[_FALLBACKS] + 1.0
        slacks = np.nan_to_num(found.slack)
        cost = float(found.input @ found.input)
        elapsed = time.perf_counter() - started
        values.set_value(self._tick, [tick + 1])
        values.set_value(self._input, found.input)
        values.set_value(self._status, [solved, elapsed, cost, slacks.max(), fallbacks, _REASONS[found.status]])
        values.set_value(self._slack, slacks)
        at_bound = found.psi <= _AT_BOUND * np.abs(found.psi).max()
        values.set_value(self._active, at_bound & bool(found.input.any()))  # without barriers the input is zero

    def _calc_h(self, context: Context, output: BasicVector) -> None:
        tick = round(context.get_discrete_state(self._tick)[0])
        state = self._state.Eval(context)
        output.SetFromVector([barrier.h(tick, state) for barrier in self._tube.barriers])
