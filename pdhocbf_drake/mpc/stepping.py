"""A robot that stands, or is about to, steps again where only a step keeps its balance."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.plan import Plan
from pdhocbf_drake.walking.footsteps import Resumed
from pdhocbf_drake.walking.frame import rotation
from pdhocbf_drake.walking.sides import BOTH, LEFT

_MISSED = 2e-3 / 0.58  # of the CoM's height: a tail that is missed by more lets the robot fall
_FAR = 0.75  # share of the half box of a stand: a divergent component farther out leaves too little to balance with
_SHORTEST = 5  # with less than a fifth of a step left no foot swings; it waits for the next step


def steps_again(mpc: PeriodicMpc, state: np.ndarray, centre: np.ndarray, plan: Plan) -> Resumed:
    """The steps to take in place of a stand, after a plan for those so far.

    A disturbed walk may miss its tail, at a price. Close to the end of the walk the coming footholds are given, and a
    tail is missed where the ZMP can't come far enough to balance the divergent component: only a step helps then. A
    walk adds one, too, where it would come to its stand with a divergent component far from the middle of the feet.
    One is added at a time, so that the plan has one or two footholds to choose; in a stand a foot lifts off at once.

    Args:
        state: c, v, p of x, then of y from which the plan was made, shape (2, 3).
        centre: of the stance, shape (2,) [m].
    """
    gait, known = mpc.gait, mpc.gait.footsteps.resumed
    if mpc.recovery is None or not plan.recovering:
        return known
    step = plan.tick // gait.period
    end = gait.seen(step).end
    if gait.support(step) == BOTH:
        return _out_of_a_stand(mpc, mpc.recovery, state, centre, plan)
    if end is None or end > step + 1:
        return known
    missed = _MISSED * gait.config.com_height
    if mpc.recovery.missed_tail(state, plan) <= missed and _ends_well(mpc.recovery, state, plan, end):
        return known
    if known.tick >= 0 and known.last >= step:
        return known._replace(last=end + 1)
    return Resumed((end + 1) * gait.period, -gait.support(end), end + 1)


def about_to_stand(mpc: PeriodicMpc, tick: int) -> bool:
    """Whether a foot swings at tick k in place of a stand, or in one of the last two steps before it."""
    step = tick // mpc.gait.period
    footsteps = mpc.gait.seen(step)
    ends = footsteps.end is not None and footsteps.end <= step + 1
    return footsteps[step].side != BOTH and (ends or step <= footsteps.resumed.last)


def _out_of_a_stand(
    mpc: PeriodicMpc, recovery: PeriodicMpc, state: np.ndarray, centre: np.ndarray, plan: Plan
) -> Resumed:
    """Two steps from a stand, or as many as there are before the walk begins."""
    gait, known = mpc.gait, mpc.gait.footsteps.resumed
    step, phase = gait.phase(plan.tick)
    first = step if _SHORTEST * (gait.period - phase) >= gait.period else step + 1
    if gait.support(first) != BOTH:
        return known
    commanded = recovery.commanded.steps(step)
    away = _seen(state[:, 0] + state[:, 1] / mpc.divergent.omega[phase] - centre, commanded.yaw)
    within = np.abs(away) <= commanded.half[:, 1]
    if np.all(within) and recovery.missed_tail(state, plan) <= _MISSED * gait.config.com_height:
        return known
    side = -LEFT if away[1] > 0.0 else LEFT  # it falls away from its stance foot
    last = first + 1
    expected = gait.seen(step)
    for walks in (first + 1, first + 2):
        if expected[walks].side != BOTH:
            side, last = expected[walks].side * (-1) ** (walks - first), walks - 1
            break
    return Resumed(plan.tick if first == step else first * gait.period, side, last)


def _ends_well(mpc: PeriodicMpc, state: np.ndarray, plan: Plan, end: int) -> bool:
    """Whether the divergent component is near the middle of the feet where the stand after step `end` begins.

    Or on the outer side of the foot that stands in step `end`: one more step would be on the other foot, which is
    farther away; a stand has both.
    """
    step, phase = mpc.gait.phase(plan.tick)
    ahead = (end + 1 - step) * mpc.gait.period - phase
    phi, gamma = mpc.vhip.prediction(plan.tick, mpc.config.horizon)
    c, v, _ = np.array([phi[ahead] @ s + gamma[ahead] @ u for s, u in zip(state, plan.inputs, strict=True)]).T
    commanded = mpc.commanded.steps(step)
    away = _seen(c + v / mpc.divergent.omega[0] - plan.footholds[:, end - step], commanded.yaw)
    inward = abs(away[0]), -mpc.gait.support(end) * away[1]
    return bool(np.all(inward <= _FAR * commanded.half[:, end - step + 2]))


def _seen(way: np.ndarray, yaw: float) -> np.ndarray:
    """A way (2,) along the axes of a foot with that heading."""
    return rotation(-yaw) @ way if yaw else way
