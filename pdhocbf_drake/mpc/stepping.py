"""A robot that stands, or is about to, steps again where only a step keeps its balance."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.plan import Plan
from pdhocbf_drake.walking.footsteps import BOTH, LEFT, Resumed

_MISSED = 2e-3  # [m]: a tail that is missed by more lets the robot fall
_FAR = 0.75  # share of the half box of a stand: a divergent component farther out leaves too little to balance with
_SHORTEST = 16  # [ticks]: in less time no foot swings; it waits for the next step


def about_to_stand(mpc: PeriodicMpc, tick: int) -> bool:
    """Whether a foot still swings at tick k, and after it or after one more step both stand."""
    step, end = tick // mpc.gait.period, mpc.gait.footsteps.end
    return end is not None and end <= step + 1 and mpc.gait.support(step) != BOTH


def steps_again(mpc: PeriodicMpc, tick: int, state: np.ndarray, plan: Plan) -> Resumed:
    """The steps to take in place of a stand, after the plan made at tick k for those so far.

    A disturbed walk may miss its tail, at a price. Close to the end of the walk the coming footholds are given, and a
    tail is missed where the ZMP can't come far enough to balance the divergent component: only a step helps then. A
    walk adds one, too, where it would come to its stand with a divergent component far from the middle of the feet.
    One is added at a time, so that the plan has one or two footholds to choose; in a stand a foot lifts off at once.
    """
    gait, known = mpc.gait, mpc.gait.footsteps.resumed
    step, phase = gait.phase(tick)
    end = gait.footsteps.end
    if end is None or end > step + 1 or not plan.recovering or mpc.recovery is None:
        return known
    stands = gait.support(step) == BOTH
    if mpc.recovery.missed_tail(state, plan) <= _MISSED and (stands or _ends_well(mpc.recovery, state, plan, end)):
        return known
    if not stands:
        if known.tick >= 0 and known.last >= step:
            return known._replace(last=end + 1)
        return Resumed((end + 1) * gait.period, -gait.support(end), end + 1)
    first = step if gait.period - phase >= _SHORTEST else step + 1
    after = gait.support(first + 1)
    side = -after if after != BOTH else _falling_from(mpc, tick, state)
    return Resumed(tick if first == step else first * gait.period, side, max(end, first + 1))


def _ends_well(mpc: PeriodicMpc, state: np.ndarray, plan: Plan, end: int) -> bool:
    """Whether the divergent component is near the middle of the feet where the stand after step `end` begins."""
    step, phase = mpc.gait.phase(plan.tick)
    ahead = (end + 1 - step) * mpc.gait.period - phase
    phi, gamma = mpc.vhip.prediction(plan.tick, mpc.config.horizon)
    c, v, _ = np.array([phi[ahead] @ s + gamma[ahead] @ u for s, u in zip(state, plan.inputs, strict=True)]).T
    away = c + v / mpc.divergent.omega[0] - plan.footholds[:, end - step]
    return bool(np.all(np.abs(away) <= _FAR * mpc.commanded.steps(step).half[:, end - step + 2]))


def _falling_from(mpc: PeriodicMpc, tick: int, state: np.ndarray) -> int:
    """The foot that the robot falls away from sideways, which is to be the stance foot."""
    c, v, p = state[1].tolist()
    return -LEFT if c + v / mpc.divergent.omega[tick % mpc.gait.period] > p else LEFT
