"""The walk's controller stepped by hand, tick by tick, from measurements that come from anywhere."""

import numpy as np

from pdhocbf_drake import WalkController, load_scenario

scenario = load_scenario("vhip")
controller = WalkController.of(scenario)
tick, gait = scenario.gait.tick, controller.mpc.gait

# The measured CoM position and velocity and the ZMP, of x, then of y. A robot would measure them; here a pendulum of
# varying height answers: c⁺ = c + δ v, v⁺ = v + δ η(k) (c − p), p⁺ = p + δ u.
state = np.zeros((2, 3))
for k in range(400):
    if k == 250:
        state[1, 1] += 0.15  # a kick to the left [m/s]
    plan = controller.step(k, state)
    if k % 40 == 0 or 250 <= k < 253:
        foothold = plan.footholds[:, 0]
        step, phase = gait.phase(k)
        where = f"step {step}, tick {phase:2d}: CoM {state[0, 0]:5.2f} m, {state[1, 0]:+.3f} m"
        print(f"{where}; next foothold {foothold[0]:5.2f} m, {foothold[1]:+.3f} m; {plan.reason.name}")
    z, _, acceleration = gait.height(k)
    c, v, p = state.T
    eta = (acceleration + 9.81) / z
    state = np.stack([c + tick * v, v + tick * eta * (c - p), p + tick * plan.inputs[:, 0]], axis=1)
