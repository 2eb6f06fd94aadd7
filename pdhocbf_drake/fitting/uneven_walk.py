"""A walk over uneven ground without a simulation: whether legs reach each step, and how its feet swing over edges."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.fitting.preview import PEAK
from pdhocbf_drake.robot import Biped, WholeBodyIk
from pdhocbf_drake.robot.posture import COM, TargetPoses
from pdhocbf_drake.systems.kernels import write_wanted
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
    """Which posture of a step is out of reach, of every few."""
    ik, q = WholeBodyIk(biped), None
    for wanted, angles in step_motion(gait, step, _EVERY):
        wanted[0, COM.stop - 1] += reserve
        if q is None:
            q = biped.bent_knee.copy()
            q[biped.base_q_index[4:]] = wanted[0, COM]
        found = ik.solve_poses(TargetPoses(wanted[0], *angles), q)
        if not found.ok:
            return found.reason
        q = found.q
    return ""


def step_motion(gait: Gait, step: int, every: int) -> Iterator[tuple[np.ndarray, tuple[float, ...]]]:
    """Ticks of a step over uneven ground: place, velocity and acceleration in task coordinates (3, 18), and roll,
    pitch and yaw of torso, left and right sole, whose rates are left out.

    The CoM goes from the middle m_0 of the feet before the step to that after it, and towards the stance foot p on the
    way of a pendulum, ω² = g/z, with τ the time from mid-stance; it is accelerated as one whose ZMP is in that foot:

        m(t) = m_0 + (m_T − m_0) t/T,    x = m_x,    y = m_y + (1 − cosh ωτ/cosh ωT/2) (p_y − m_y),    c̈ = ω² (c − p).

    Args:
        every: which ticks, from the first one on.
    """
    swing, line, tick = Swing(gait), ComLine(gait.period, gait.config.tick), gait.config.tick
    last, this, coming = (gait.step(i) for i in (step - 1, step, step + 1))
    plan, swinging, zmp = np.zeros((2, 2, 2)), 1 if this.side > 0 else 0, np.array([this.x, this.y])
    plan[1 - swinging], plan[swinging] = zmp, [(last.x, last.y), (coming.x, coming.y)]
    start, end = (0.5 * (zmp + other) for other in plan[swinging])
    omega, planes, profile = math.sqrt(GRAVITY / gait.config.com_height), gait.planes(step), gait.profiles(step)[0]
    feet, duration = np.zeros(18), gait.period * tick
    widest = math.cosh(0.5 * omega * duration)
    for k in range(gait.period):
        feet = swing.feet(k, this.side, plan.ravel(), feet, gait.lift_off(step), profile)
        if k % every:
            continue
        soles, lateral = feet.copy(), omega * tick * (k - gait.period / 2)
        swing.put_on_ground(k, this.side, planes, soles, gait.lift_off(step), profile)
        com, velocity = start + k / gait.period * (end - start), (end - start) / duration
        velocity[1] -= omega * math.sinh(lateral) / widest * (this.y - com[1])
        com[1] += (1.0 - math.cosh(lateral) / widest) * (this.y - com[1])
        moving = com, velocity, omega**2 * (com - zmp)
        wanted = np.zeros((3, 18))
        write_wanted(np.transpose(moving).ravel(), np.add(gait.height(k), line(k, planes, *moving)), soles, wanted)
        slopes = (_slope(i, swinging, k, gait, last, this, coming) for i in (0, 1))
        yield wanted, (0.0, 0.0, 0.0, *(angle for slope in slopes for angle in _tilt(slope)))


def _slope(
    foot: int, swinging: int, tick: int, gait: Gait, last: Footstep, this: Footstep, coming: Footstep
) -> tuple[float, float]:
    """∂z/∂x and ∂z/∂y of what a sole is parallel to: its stance, or the nearer one of those between which it swings."""
    if foot != swinging:
        return this.slope
    return last.slope if 2 * tick < gait.period + gait.config.double_support_ticks else coming.slope


def _tilt(slope: tuple[float, float]) -> tuple[float, float, float]:
    """Roll, pitch and yaw of a sole that faces along x on a plane."""
    x, y = slope
    return math.asin(y / math.sqrt(1.0 + x * x + y * y)), -math.atan(x), 0.0
