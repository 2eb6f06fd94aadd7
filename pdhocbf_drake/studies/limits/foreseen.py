"""The largest push that a plan of the template survives which foresees it, at the commanded height of the CoM.

The CoM ahead of the stance foot follows  c̈ = eta(k) (c − p) + F/m  with a ZMP p of any velocity and two footholds
within reach; there is neither delay nor feedback. A leg that stands alone holds an interval of p at each c and tick,
see `HeldZmp`. At the end of the interval on the side to which the CoM is pushed, p holds it back most.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from pdhocbf_drake.fitting.held_zmp import HeldZmp
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.orbit import settled_gait
from pdhocbf_drake.mpc.programs import ProgramCache
from pdhocbf_drake.robot import SIDES, Biped
from pdhocbf_drake.simulation.build import nominal_mpc
from pdhocbf_drake.simulation.scenario import Scenario

HELD_ROLES: Final = ("hip_pitch", "knee_pitch", "ankle_pitch")
"""Whose torques are kept, those of the leg that stands."""

_PLACES = np.linspace(-0.5, 0.5, 61)  # of the CoM from the stance foot, over its height
_STEPS = np.linspace(-1.0, 1.0, 17)  # to the next footholds, over the longest one
_IMPULSES = np.linspace(0.0, 2.0, 117)  # over the robot's mass [m/s]
_PUSH = 0.1  # [s]
_CLOSE = 1e-6  # [m/s], see `settled_gait`


class _Walks(NamedTuple):
    """Walks (n,) that are pushed alike, each with an impulse over the robot's mass [m/s] and two footholds of its own.

    Attributes:
        held: what the leg that stands holds. sole: half its length, less the margin [m].
        steps: to the next footholds, (n,) each [m].
        way: 1.0 is ahead, −1.0 back.
    """

    mpc: PeriodicMpc
    held: HeldZmp
    sole: float
    impulse: np.ndarray
    steps: tuple[np.ndarray, np.ndarray]
    way: float

    def survive(self, phase: int, start: tuple[float, float, float]) -> np.ndarray:
        """Whether a ZMP on the third foot could stop them at the end of its step.

        Args:
            phase: tick of a step at which the push begins.
            start: CoM from the stance foot [m], its velocity [m/s], and the last foot from the stance foot [m].
        """
        gait, delta, double = self.mpc.gait, self.mpc.vhip.tick, self.mpc.gait.config.double_support_ticks
        c, v, last = (np.full(len(self.impulse), value) for value in start)
        alive = np.full(len(self.impulse), True)
        for tick in range(phase, 3 * gait.period):
            step, now = divmod(tick, gait.period)
            if step and not now:
                c, last = c - self.steps[step - 1], -self.steps[step - 1]
                alive &= self._reaches(now, c) & self._reaches(now, c - last)
            if now < double:
                zmp = (1.0 - gait.region.weight[now]) * last + self.way * self.sole
            else:
                zmp, holds = self._farthest(now, c)
                alive &= holds
            pushed = self.way * self.impulse / _PUSH * ((tick - phase) * delta < _PUSH)
            c, v = c + delta * v, v + delta * (self.mpc.vhip.eta[now] * (c - zmp) + pushed)
        return alive & (np.abs(c + v / self.mpc.divergent.omega[0]) <= self.sole)

    def _farthest(self, tick: int, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The ZMP farthest on the side of the push [m], and whether the leg holds one, (n,) each."""
        low, high = (np.interp(c, self.held.places, ends[tick]) for ends in (self.held.low, self.held.high))
        low, high = np.maximum(low, -self.sole), np.minimum(high, self.sole)
        holds = low <= high
        return np.where(holds, high if self.way > 0.0 else low, 0.0), holds

    def _reaches(self, tick: int, c: np.ndarray) -> np.ndarray:
        return np.isfinite(np.interp(c, self.held.places, self.held.low[tick]))


def survived(scenario: Scenario, biped: Biped, way: float, phases: tuple[int, ...]) -> list[float]:
    """The largest impulses ahead (`way` 1.0) or back (−1.0) that a plan survives, begun at ticks of a step [N s].

    Args:
        scenario: a walk with `mpc.limits` as numbers, in whose steady state the push comes.
    """
    mpc, limits = nominal_mpc(scenario, scenario.gait.stride, ProgramCache()), scenario.mpc.plan_limits
    assert limits is not None
    held = HeldZmp.of(biped, scenario.gait, HELD_ROLES, _PLACES * scenario.gait.com_height, 1.0)
    sole = min(float(biped.soles[side].half_size[0]) for side in SIDES) - scenario.mpc.zmp_margin
    steps = _STEPS * limits.step_reach[0]
    impulse, first, second = (axis.ravel() for axis in np.meshgrid(_IMPULSES, steps, steps))
    walks, orbit, found = (
        _Walks(mpc, held, sole, impulse, (first, second), way),
        settled_gait(mpc.gait, mpc, _CLOSE),
        [],
    )
    for phase in phases:
        before = next(tick.before for tick in orbit if mpc.gait.phase(tick.tick)[1] == phase)
        last, _, now, *_ = before.stance_plan.tolist()
        x, v = before.com_reference[:2].tolist()
        alive = walks.survive(phase, (x - now, v, last - now))
        found.append(biped.mass * float(impulse[alive].max(initial=0.0)))
    return found
