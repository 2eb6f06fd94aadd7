"""A walk over uneven ground without a simulation: whether legs reach each step, and how its feet swing over edges."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.fitting.preview import PEAK
from pdhocbf_drake.robot import Biped, Posture, WholeBodyIk
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.com_height import GRAVITY
from pdhocbf_drake.walking.com_line import ComLine
from pdhocbf_drake.walking.footsteps import Footstep
from pdhocbf_drake.walking.sides import BOTH
from pdhocbf_drake.walking.swing import Swing
from pdhocbf_drake.walking.swing_profile import Timing

HURRIED = 3.0
"""Largest acceleration of a swinging foot ahead, over that of gravity, at which the robot still stands firmly."""
LEAST_CLEARANCE = 0.005
"""Distance of a swinging sole from edges, as planned, below which it can't be walked [m]."""
_RESERVE = 0.02  # that legs keep of their length, as height of the CoM [m]
_EVERY = 4  # ticks of which a posture is looked at


class UnevenStep(NamedTuple):
    """What a step over uneven ground asks for.

    Attributes:
        number: j. place: x of the stance [m]. rise: of the ground from the last foothold to the next [m].
        clearance: least distance of the swinging sole from edges, infinite where there are none [m].
        acceleration: largest one of the swinging foot ahead, over that of gravity.
        missed: which posture is out of the legs' reach; empty if none is.
    """

    number: int
    place: float
    rise: float
    clearance: float
    acceleration: float
    missed: str


def uneven_steps(biped: Biped | None, gait: Gait, reserve: float = _RESERVE) -> Iterator[UnevenStep]:
    """Every step of a walk whose ground is not level, each kind of step once.

    Args:
        biped: whose legs are asked; None leaves them out.
        reserve: by how much higher the CoM is taken to be [m].
    """
    ground, timing, seen = gait.footsteps.known_ground, Timing(gait.swing_ticks(), gait.config.tick), set[object]()
    assert ground is not None
    for j in range(len(gait.footsteps.listed)):
        last, this, coming = (gait.step(i) for i in (j - 1, j, j + 1))
        kind = _kind(last, this, coming)
        if BOTH in (last.side, this.side) or kind in seen:
            continue
        seen.add(kind)
        profile, start, end = gait.profiles(j)[0], (last.x, last.y), (coming.x, coming.y)
        moving = (timing.ticks - profile.wait - profile.early) * timing.tick
        acceleration = PEAK * abs(end[0] - start[0]) / moving**2 / GRAVITY
        clearance = ground.clearance(profile, timing, start, end)
        missed = "" if biped is None else _missed(biped, gait, j, reserve)
        yield UnevenStep(j, this.x, coming.height - last.height, clearance, acceleration, missed)


def _kind(*steps: Footstep) -> object:
    """What steps have in common that are alike but for where they are."""
    _, this, _ = steps
    return tuple(
        (
            round(s.x - this.x, 4),
            round(s.side * this.side * (s.y - this.y), 4),
            round(s.height - this.height, 4),
            s.slope,
        )
        for s in steps
    ), this.side if any(this.slope) else 0


def _missed(biped: Biped, gait: Gait, step: int, reserve: float) -> str:
    """Which posture of a step is out of reach, on the way of a pendulum between the middles of its feet."""
    swing, line, ik = Swing(gait), ComLine(gait.period, gait.config.tick), WholeBodyIk(biped)
    last, this, coming = (gait.step(i) for i in (step - 1, step, step + 1))
    plan, swinging = np.zeros((2, 2, 2)), 1 if this.side > 0 else 0
    plan[1 - swinging], plan[swinging] = (this.x, this.y), [(last.x, last.y), (coming.x, coming.y)]
    ends = np.array(
        [[0.5 * (last.x + this.x), 0.5 * (this.x + coming.x)], [0.5 * (last.y + this.y), 0.5 * (this.y + coming.y)]]
    )
    omega, planes, profile = math.sqrt(GRAVITY / gait.config.com_height), gait.planes(step), gait.profiles(step)[0]
    feet, q = np.zeros(18), biped.bent_knee.copy()
    half = 0.5 * omega * gait.period * gait.config.tick
    for tick in range(gait.period):
        feet = swing.feet(tick, this.side, plan.ravel(), feet, gait.lift_off(step), profile)
        if tick % _EVERY:
            continue
        soles, share = feet.copy(), tick / gait.period
        swing.put_on_ground(tick, this.side, planes, soles, gait.lift_off(step), profile)
        com = ends[:, 0] + share * (ends[:, 1] - ends[:, 0])
        com[1] += (1.0 - math.cosh(half * (2.0 * share - 1.0)) / math.cosh(half)) * (this.y - com[1])
        z = gait.height(tick)[0] + line(tick, planes, com, np.zeros(2), np.zeros(2))[0] + reserve
        left, right = (
            _sole(soles[9 * i : 9 * i + 3], _slope(i, swinging, tick, gait, last, this, coming)) for i in (0, 1)
        )
        if tick == 0:
            q[biped.base_q_index[4:]] = *com, z
        found = ik.solve(Posture(np.array([*com, z]), left, right), q)
        if not found.ok:
            return found.reason
        q = found.q
    return ""


def _slope(
    foot: int, swinging: int, tick: int, gait: Gait, last: Footstep, this: Footstep, coming: Footstep
) -> tuple[float, float]:
    """∂z/∂x and ∂z/∂y of what a sole is parallel to: its stance, or the nearer one of those between which it swings."""
    if foot != swinging:
        return this.slope
    return last.slope if 2 * tick < gait.period + gait.config.double_support_ticks else coming.slope


def _sole(place: np.ndarray, slope: tuple[float, float]) -> np.ndarray:
    """A sole that faces along x on a plane (6,)."""
    x, y = slope
    roll, pitch = math.asin(y / math.sqrt(1.0 + x * x + y * y)), -math.atan(x)
    return np.array([*place, roll, pitch, 0.0])
