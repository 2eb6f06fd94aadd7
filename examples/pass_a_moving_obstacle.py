"""A point in the plane goes to its goal past a round obstacle that swings to and fro with a period of 8 s."""

import numpy as np

from pdhocbf_drake.barriers import Barrier, NonlinearFilter, PeriodicAffineSystem, record

tick, period, radius, fastest = 0.1, 80, 0.5, 1.0  # [s], [ticks], [m], [m/s]
plane = PeriodicAffineSystem(np.eye(2), tick * np.eye(2))  # x(k+1) = x(k) + tick·u(k): the input is a velocity
goal = np.array([3.0, 0.0])


def outside(swing):
    """h(k, x) = ‖x − c(k)‖² − r², c(k) the obstacle's centre [m²]."""

    def h(k, x):
        centre = np.array([1.5, swing * np.sin(2 * np.pi * k / period)])
        return (x - centre) @ (x - centre) - radius**2

    return Barrier("obstacle", h, period, [0.3], "m²")


def towards_goal(x):
    distance = np.linalg.norm(goal - x)
    return (goal - x) * min(1.0, fastest / max(distance, 1e-9))


for what, swing, start in (
    ("the obstacle swings by 0.6 m", 0.6, [0.0, 0.0]),
    ("it stands, the start is 1 mm aside", 0.0, [0.0, 0.001]),
    ("it stands, the start is in line", 0.0, [0.0, 0.0]),
):
    barrier = outside(swing)
    keep = NonlinearFilter(plane, [barrier], lower=[-1.5, -1.5], upper=[1.5, 1.5])
    states, statuses = [np.array(start)], set()
    for k in range(200):
        result = keep(k, states[-1], towards_goal(states[-1]))
        statuses.add(result.status)
        states.append(plane.step(k, states[-1], result.input))
    left = np.linalg.norm(goal - states[-1])
    print(f"{what}: h ≥ {record(barrier, states).h_min:.4f} m², {left:.2f} m from the goal, {', '.join(statuses)}")
