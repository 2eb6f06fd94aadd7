"""The bound of a barrier along a walk that follows commands."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.walking.commanded_walk import CommandedFootsteps
from pdhocbf_drake.walking.commands import STOP, Command
from pdhocbf_drake.walking.frame import rotation
from pdhocbf_drake.walking.gait import Gait
from pdhocbf_drake.walking.quantities import stance_sides
from pdhocbf_drake.walking.sides import BOTH
from pdhocbf_drake.walking.walk_barrier import WalkBarrier

Array = NDArray[np.float64]


class CommandedBound:
    """V̄(k), …, V̄(k+n−1) of a barrier along a walk that follows commands.

    Let s_c(q) be the settled walk under a constant command c at tick q of a step on the foot that stands (inner and
    outer steps of a turn differ, so that it repeats after two steps), seen from that foot and along its heading, and
    V_c = ±margin + σ n_q·s_c(q) the bound that follows this orbit, or with `peak` its extreme value over both steps.
    While the command changes there is no orbit. V̄ is the outer envelope

        V̄(k) = max { V_c(q) : c ∈ C_j }   for an upper bound, min for a lower one,

    over the commands C_j of step j and of the `UNSETTLED` steps before it (`CommandedFootsteps.under`), where the stand
    is the orbit of a stop: V_stop = ±margin + q°, q° = σ n_q·(−f) as seen from a foot f at rest. In a stand q is
    counted from the middle between the feet, and so is V̄: the envelope less q°. A bound that follows no orbit has
    V_c = V̄ of the foot that stands, and, where `at_rest`, V_stop = q°. A plan from step j has C_j in its coming steps,
    too: what it plans for them has not settled either.

    The rows of a plan from step j see a coming step, turned by ψ, along the axes of step j. There V̄ is

        V̄(k) + σ n_q·(R(ψ) s_c(q) − s_c(q)),   with the command c that is expected to hold,

    so that the orbit itself is judged exactly, and deviations from it but for the factor cos ψ.
    """

    def __init__(self, barrier: WalkBarrier, gait: Gait, count: int) -> None:
        assert barrier.orbits is not None
        self._barrier, self._orbits, self._gait, self._count = barrier, barrier.orbits, gait, count
        self._steps = 2 + (count - 2) // gait.period
        self._outer = np.maximum if barrier.sign > 0 else np.minimum
        self._of_step = lru_cache(maxsize=4)(self._from_step)
        self._limit = lru_cache(maxsize=64)(self._limit_of)

    def __call__(self, tick: int) -> Array:
        """V̄(k) … V̄(k+n−1), shape (n,)."""
        step, phase = self._gait.phase(tick)
        return self._of_step(step)[phase : phase + self._count]

    def _from_step(self, step: int) -> Array:
        """From the first tick of a step on."""
        seen, yaw = self._gait.seen(step), self._gait.step(step).yaw
        assert isinstance(seen, CommandedFootsteps)
        first = stance_sides(self._gait.config)[(step + self._gait.flipped(step)) % 2]
        parts, unsettled = [], seen.under(step)
        for i in range(self._steps):
            footstep, commands = seen[step + i], seen.under(step + i) | unsettled
            side = first * (-1.0) ** i if footstep.side == BOTH else float(footstep.side)
            limits = [limit for c in commands if (limit := self._limit(c, side)) is not None]
            part = limits[0] if limits else np.full(self._gait.period, self._no_limit)
            for limit in limits[1:]:
                part = self._outer(part, limit)
            if footstep.side == BOTH:
                part = part - self._values(self._rest(side), side)
            elif footstep.yaw != yaw:
                part = part + self._turned(seen.under_now(step + i), side, footstep.yaw - yaw)
            parts.append(part)
        return np.concatenate(parts)

    @property
    def _no_limit(self) -> float:
        return self._barrier.sign * self._barrier.quantity.largest

    def _limit_of(self, command: Command, side: float) -> Array | None:
        """V_c over a step, shape (N,)."""
        barrier, margin = self._barrier, self._orbits.margin
        if margin is None:
            own = barrier.bound.samples(self._tick(side), self._gait.period)
            return (
                self._outer(own, self._values(self._rest(side), side)) if command == STOP and barrier.at_rest else own
            )
        sides = (side, -side) if self._orbits.peak else (side,)
        orbits = [self._orbit(command, foot) for foot in sides]
        values = [self._values(orbit, foot) for orbit, foot in zip(orbits, sides, strict=True) if orbit is not None]
        if len(values) < len(sides):
            return None
        if self._orbits.peak and command != STOP:
            values = [np.full(self._gait.period, (max if barrier.sign > 0 else min)(np.concatenate(values)))]
        return np.asarray(values[0] + barrier.sign * margin)

    def _turned(self, command: Command, side: float, turn: float) -> Array:
        """σ n·(R(ψ) s − s) over a step, shape (N,); zero where there is no orbit."""
        orbit = self._orbit(command, side)
        if orbit is None:
            return np.zeros(self._gait.period)
        return self._values(np.tensordot(rotation(turn), orbit, axes=1) - orbit, side)

    def _orbit(self, command: Command, side: float) -> Array | None:
        """s over a step on that foot, shape (2, N, 3)."""
        if command == STOP:
            return self._rest(side)
        orbit = self._orbits.of(command)
        return None if orbit is None else orbit[0 if side > 0.0 else 1]

    def _rest(self, side: float) -> Array:
        state = np.zeros((2, self._gait.period, 3))
        state[1, :, [0, 2]] = -side * self._gait.footsteps.width / 2.0
        return state

    def _values(self, states: Array, side: float) -> Array:
        """σ n_q·s over a step on that foot, shape (N,)."""
        normals = self._barrier.normals(self._tick(side), self._gait.period)
        return np.asarray((normals * states[self._barrier.quantity.axis]).sum(axis=1))

    def _tick(self, side: float) -> int:
        """The first tick of a step on that foot, in a walk whose feet alternate from its start on."""
        return 0 if stance_sides(self._gait.config)[0] == side else self._gait.period
