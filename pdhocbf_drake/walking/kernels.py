"""The arithmetic of template, support region and swing foot in a tick, as machine code."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.jit import compiled


@compiled
def write_following(
    A: np.ndarray, B: np.ndarray, state: np.ndarray, zmp_velocity: np.ndarray, following: np.ndarray
) -> None:
    """Writes A s + B u of both axes: `Vhip.step_axes`."""
    for axis in range(2):
        for i in range(3):
            total = B[i] * zmp_velocity[axis]
            for j in range(3):
                total += A[i, j] * state[axis, j]
            following[axis, i] = total


@compiled
def write_box(
    ahead: int, weight: float, stance: np.ndarray, footholds: np.ndarray, half: np.ndarray, margin: float,
    box: np.ndarray,
) -> None:  # fmt: skip
    """Writes `SupportRegion.box`; `ahead` is 1 where k + 1 is the first tick of the next step, else 0."""
    for axis in range(2):
        start = stance[axis, ahead]
        end = stance[axis, 1] if ahead == 0 else footholds[axis, 0]
        centre = (1.0 - weight) * start + weight * end
        side = (1.0 - weight) * half[axis, ahead] + weight * half[axis, ahead + 1] + margin
        box[axis, 0], box[axis, 1] = centre - side, centre + side


@compiled
def write_references(
    A: np.ndarray, B: np.ndarray, eta: float, state: np.ndarray, zmp_velocity: np.ndarray, following: np.ndarray,
    out: np.ndarray,
) -> None:  # fmt: skip
    """Writes A s + B u of both axes, and what follows for the robot.

    Args:
        eta: of the tick that follows [1/s²].
        out: x, ẋ, ẍ, y, ẏ, ÿ of the CoM, then the ZMP's x, ẋ, y, ẏ, (10,).
    """
    write_following(A, B, state, zmp_velocity, following)
    for axis in range(2):
        c, v, p = following[axis, 0], following[axis, 1], following[axis, 2]
        out[3 * axis], out[3 * axis + 1], out[3 * axis + 2] = c, v, eta * (c - p)
        out[6 + 2 * axis], out[7 + 2 * axis] = p, zmp_velocity[axis]


@compiled
def write_foot_plan(
    swinging: int, stands_after: bool, stance: np.ndarray, footholds: np.ndarray, feet: np.ndarray, out: np.ndarray
) -> None:
    """Writes where the feet stand and where they go, for one step.

    Args:
        swinging: the foot that swings, 0 left, 1 right, −1 none.
        stands_after: whether both feet stand side by side in the next step: then they frame its centre.
        stance: centres of the last and of this step per axis, (2, 2). footholds: of the coming ones, (2, n_f).
        feet: left, then right, (2, 2).
        out: centres of the last, this and the next two steps; then for each foot its start and its end, (16,).
    """
    for axis in range(2):
        for i in range(2):
            out[2 * i + axis], out[4 + 2 * i + axis] = stance[axis, i], footholds[axis, i]
            out[8 + 4 * i + axis] = out[10 + 4 * i + axis] = feet[i, axis]
        if swinging >= 0:
            landing = footholds[axis, 0]
            out[10 + 4 * swinging + axis] = 2.0 * landing - stance[axis, 1] if stands_after else landing


@compiled
def least_jerk(
    position: float, velocity: float, acceleration: float, end: float, remaining: float
) -> tuple[float, float, float, float, float, float]:
    """p, v, a, c₃, c₄, c₅ of p + v s + a s²/2 + c₃ s³ + c₄ s⁴ + c₅ s⁵ [m], s = time/`remaining`: least jerk to rest."""
    v, a, gap = velocity * remaining, acceleration * remaining**2, end - position
    third = 10.0 * gap - 6.0 * v - 1.5 * a
    fourth = -15.0 * gap + 8.0 * v + 1.5 * a
    fifth = 6.0 * gap - 3.0 * v - 0.5 * a
    return position, v, a, third, fourth, fifth


@compiled
def onward(
    position: float, velocity: float, acceleration: float, end: float, remaining: float, ahead: float
) -> tuple[float, float, float]:
    """Position, velocity, acceleration along one axis `ahead` seconds later on the motion of least jerk to `end`.

    From rest it is the motion of `swing_point`. Planned anew at every tick for an end that moves, it has no jump in
    position, velocity or acceleration.

    Args:
        position, velocity, acceleration: now [m, m/s, m/s²].
        end: where the foot comes to rest [m].
        remaining: time until then, > 0 [s]. ahead: at most `remaining` [s].
    """
    if ahead >= remaining - 1e-9:
        return end, 0.0, 0.0
    s = ahead / remaining
    c = least_jerk(position, velocity, acceleration, end, remaining)
    return (
        c[0] + s * (c[1] + s * (0.5 * c[2] + s * (c[3] + s * (c[4] + s * c[5])))),
        (c[1] + s * (c[2] + s * (3.0 * c[3] + s * (4.0 * c[4] + s * 5.0 * c[5])))) / remaining,
        (c[2] + s * (6.0 * c[3] + s * (12.0 * c[4] + s * 20.0 * c[5]))) / remaining**2,
    )


@compiled
def write_feet(
    swinging: int, aloft: tuple[int, int, int], plan: np.ndarray, before: np.ndarray, above: np.ndarray,
    remaining: tuple[float, float], tick: float, feet: np.ndarray,
) -> None:  # fmt: skip
    """Writes `Swing.feet`.

    Args:
        swinging: the foot that swings, 0 left, 1 right, −1 none.
        aloft: ticks since lift-off, in x and y since the foot left its place along that axis, too.
        above: the swing sole's height and its derivatives, (3,).
        remaining: time left to swing along x and y at the tick before [s]. tick: δ [s].
    """
    for i in range(18):
        feet[i] = 0.0
    for foot in range(2):
        for axis in range(2):
            at = 9 * foot + axis
            feet[at] = plan[4 * foot + axis]
            if foot == swinging and aloft[axis] > 0:
                place, velocity, acceleration = feet[at], 0.0, 0.0
                if aloft[axis] > 1:
                    place, velocity, acceleration = before[at], before[at + 3], before[at + 6]
                end = plan[4 * foot + 2 + axis]
                feet[at], feet[at + 3], feet[at + 6] = onward(place, velocity, acceleration, end, remaining[axis], tick)
        if foot == swinging and aloft[2] > 0:
            for derivative in range(3):
                feet[9 * foot + 3 * derivative + 2] = above[derivative]


@compiled
def add_accelerations(
    timing: tuple[int, float], begin: tuple[int, int], duration: tuple[float, float], whole: np.ndarray, phase: int,
    support: np.ndarray, now: np.ndarray, plan: np.ndarray, after: np.ndarray, factor: tuple[float, float],
    most: float, out: np.ndarray,
) -> None:  # fmt: skip
    """Adds what `Swing.add_accelerations` describes.

    Args:
        timing: N and tick [ticks, s].
        begin, duration: of this step's swing, the tick at which the foot leaves its place along x and y, and how long
            it moves along each [ticks, s].
        whole: acceleration of a swing by one metre along x and y at each tick of this and of the coming steps, the last
            of which goes on, (n, 2, N) [1/s²].
    """
    period, tick = timing
    horizon = len(support)
    count = min(period - 1 - phase, horizon)  # ticks left of this step
    coming = count
    while coming < horizon and support[coming] == 0.0:
        coming += 1
    for axis in range(2):
        left = duration[axis] - (phase - begin[axis]) * tick  # seconds left of this step's swing
        if count and support[0] != 0.0:
            foot = 1 if support[0] > 0.0 else 0
            start, end = plan[foot, 0, axis], plan[foot, 1, axis]
            place, velocity, acceleration = now[foot, 0, axis], now[foot, 1, axis], now[foot, 2, axis]
            _, _, a, third, fourth, fifth = least_jerk(place, velocity, acceleration, end, left)
            for i in range(count):
                if phase <= begin[axis]:
                    value = (end - start) * whole[0, axis, phase + 1 + i]
                elif (i + 1) * tick < left:
                    s = (i + 1) * tick / left
                    value = (a + s * (6.0 * third + s * (12.0 * fourth + s * 20.0 * fifth))) / left**2
                else:
                    value = 0.0  # the foot has come to where it lands
                out[axis, i] += min(max(factor[axis] * value, -most), most)
        if coming < horizon:
            foot = 1 if support[coming] > 0.0 else 0
            way = after[axis] - plan[foot, 1, axis]
            step, place = divmod(phase + 1 + count, period)
            for i in range(count, horizon):
                value = way * whole[min(step, len(whole) - 1), axis, place] * abs(support[i])
                out[axis, i] += min(max(factor[axis] * value, -most), most)
                place += 1
                if place == period:
                    step, place = step + 1, 0
