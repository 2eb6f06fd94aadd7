"""A pendulum that is pushed all the time stays below an angle that tightens and widens with a period of 4 s."""

import numpy as np

from pdhocbf_drake.barriers import AffineBarrier, BarrierFilter, check_in_safe_set, harmonic, record


class Pendulum:
    """Angle [rad] and its rate [rad/s] under a torque per inertia [rad/s²], Euler with ticks of 20 ms."""

    period, n, m, tick = 1, 2, 1, 0.02  # the dynamics do not depend on the tick; 2 states, 1 input

    def step(self, k, x, u):
        # No numpy function here: the filter differentiates this with Drake's automatic differentiation.
        sine = x[0] - x[0] ** 3 / 6 + x[0] ** 5 / 120
        return np.array([x[0] + self.tick * x[1], x[1] + self.tick * (u[0] - 9.81 * sine - 0.5 * x[1])])


pendulum = Pendulum()
# Angle ≤ V̄(k), between 0.2 and 0.6 rad. The torque reaches the angle two ticks later: relative degree 2, two rates.
limit = harmonic(mean=0.4, cosine=0.2, sine=0.0, period=200)
barrier = AffineBarrier("angle", [1.0, 0.0], limit, +1, [0.1, 0.1], "rad")
check_in_safe_set(barrier, pendulum, 0, np.zeros(2))
keep = BarrierFilter(pendulum, [barrier])

held, free = [np.zeros(2)], [np.zeros(2)]
for k in range(800):
    push = np.array([5.0])
    result = keep(k, held[-1], push)  # the torque nearest to the push that keeps ψ_2 ≥ 0
    held.append(pendulum.step(k, held[-1], result.input))
    free.append(pendulum.step(k, free[-1], push))

for name, states in (("with the barrier", held), ("without", free)):
    found = record(barrier, states)
    print(f"{name}: h is at least {found.h_min:.3f} rad, {found.violations} of {len(states)} ticks below 0")
