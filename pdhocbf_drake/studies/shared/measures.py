"""Measures of an event: when barriers notice it and act, the largest excess, and when the walk has recovered."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.loop import Measurement, control
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.plan import Plan
from pdhocbf_drake.simulation.build import Walk, build_walk
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.shared.cases import PERIODIC, in_case

Array = NDArray[np.float64]

ACTS: Final = 1e-3
"""A barrier acts when its action exceeds the largest one of an undisturbed gait by more than this [m/s].

The action is the largest difference, in x and y, between the planned ZMP velocity and the one that the same controller
without barriers plans from the same memory and measurement. No threshold on the action itself fits all barriers, since
they act in an undisturbed walk too: on `vhip` by 5 to 12 mm/s for γ ≥ 0.5, and by 71 mm/s under DCBF with γ = 0.2.
But that action repeats from gait to gait to 1 µm/s, so 1 mm/s more is an answer to an event.
"""
_ROUNDING = 1e-9  # as h: by so much rounding may miss a bound
_NEAR = 1.01  # times the margin, since the settled walk itself repeats to a hundredth of a margin
_LEAST_MARGIN = 1e-3  # of a bound that is not drawn from an orbit [unit of h]


class Record(NamedTuple):
    """A walk from an event on; row i belongs to tick first + i.

    Attributes:
        first: the tick at which the event begins.
        states: measured c, v, p of x, then of y, shape (T, 2, 3) [m, m/s, m].
        stances: centre of the stance in x and y, shape (T, 2) [m].
        h: the values of the walk's own barriers, shape (T, n_b); n_b is 0 without barriers.
        action: of the barriers, see `ACTS`, shape (T,) [m/s]; zero without barriers.
        planned: whether the controller had a plan, shape (T,).
    """

    first: int
    states: Array
    stances: Array
    h: Array
    action: Array
    planned: NDArray[np.bool_]


class Outcome(NamedTuple):
    """The effect of an event on a walk; ticks are counted from the event, and NaN means never.

    Attributes:
        record: the walk from the event on.
        notices: first tick at which one of the walk's own barriers has h < 0, by more than rounding.
        acts: first tick at which the barriers act, see `ACTS`.
        excess: largest distance of a bounded quantity beyond its orbit, towards its bound and past it [unit of h].
        recovers: ticks until each bounded quantity stays within its margin of its orbit.
    """

    record: Record
    notices: float
    acts: float
    excess: float
    recovers: float


class SafeOrbit:
    """The reference for walks in all three cases: the undisturbed walk without barriers.

    A bounded quantity q exceeds its orbit q° by h°(k) − h(k), where h is the value of its periodic barrier (P-DHOCBF)
    and h° that of the undisturbed walk at the same phase of the gait: q − q° under an upper bound, q° − q under a
    lower one. Its margin is `bound.margin`; of a bound that is not drawn from an orbit, the least h°.

    Attributes:
        axes: the axes along which something is bounded, 0 (x) and 1 (y).
    """

    def __init__(self, scenario: Scenario, undisturbed: Record) -> None:
        """
        Args:
            scenario: its barriers say which quantities are bounded, and with which margins.
            undisturbed: at least a gait of its walk without barriers, on the template or on the robot.
        """
        # h does not depend on γ, and with γ = 1 every state with h ≥ 0 is an admissible start.
        periodic = in_case(scenario, PERIODIC, 1.0)
        self._walk = build_walk(periodic)
        self.axes = sorted(set(self._walk.axes))
        ticks = scenario.gait.ticks_per_gait
        h = values(self._walk, undisturbed.first, undisturbed.states, undisturbed.stances)
        self._nominal = np.empty((ticks, h.shape[1]))
        self._nominal[(undisturbed.first + np.arange(len(h))) % ticks] = h
        least = np.maximum(self._nominal.min(axis=0), _LEAST_MARGIN)
        given = [config.bound.margin for config in periodic.barriers.values()]
        self._margins = np.array([m if m is not None else low for m, low in zip(given, least.tolist(), strict=True)])

    def outcome(self, record: Record, undisturbed: Record) -> Outcome:
        """Judges a walk.

        Args:
            record: the walk from an event on.
            undisturbed: at least a gait of the walk under the same barriers without an event.
        """
        phases = (record.first + np.arange(len(record.states))) % len(self._nominal)
        beyond = self._nominal[phases] - values(self._walk, record.first, record.states, record.stances)
        late = np.flatnonzero((beyond > _NEAR * self._margins).any(axis=1))
        back = float(late[-1] + 1) if len(late) else 0.0
        return Outcome(
            record,
            first_tick(np.asarray((record.h < -_ROUNDING).any(axis=1))),
            first_tick(record.action > undisturbed.action.max() + ACTS),
            float(beyond.max()),
            back if back < len(beyond) else np.nan,
        )


def values(walk: Walk, first: int, states: Array, stances: Array) -> Array:
    """h of each barrier of a walk at ticks first, first + 1, …, shape (T, n_b), from parts of a `Record`."""
    pairs = list(zip(walk.axes, walk.barriers, strict=True))
    rows = [
        [barrier.h(first + i, barrier.seen(state[axis], stance[axis])) for axis, barrier in pairs]
        for i, (state, stance) in enumerate(zip(states, stances, strict=True))
    ]
    return np.array(rows, dtype=float).reshape(len(states), len(pairs))


def first_tick(mask: NDArray[np.bool_]) -> float:
    """Index of the first True; NaN where there is none."""
    return float(np.argmax(mask)) if mask.any() else np.nan


class WithoutBarriers:
    """A controller without barriers (problem (36) as `mpc`), compared with the one of a walk at each of its ticks."""

    def __init__(self, mpc: PeriodicMpc) -> None:
        self.mpc = mpc
        self._active = (np.zeros(mpc.rows[0]), np.zeros(mpc.rows[1]))

    def action(self, memory: Memory, measurement: Measurement, plan: Plan, latency: float = 0.0) -> float:
        """The change by the barriers of the ZMP velocity planned from a memory and a measurement, see `ACTS` [m/s].

        Args:
            memory: of the controller with barriers, before its update.
            measurement: its measurement at this tick.
            plan: its plan.
            latency: as for `control`.
        """
        memory = memory.copy()
        if memory.plan is not None:
            # The same footholds, but the active sets of this program.
            memory.plan = memory.plan._replace(active=self._active)
        _, free = control(self.mpc, memory, measurement._replace(bounds=None), latency)
        self._active = free.active
        return float(np.abs(plan.inputs[:, 0] - free.inputs[:, 0]).max())
