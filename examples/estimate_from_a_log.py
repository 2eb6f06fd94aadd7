"""The estimator alone, fed with the recorded sensors of a walk: any log of IMU, encoders and sole forces will do."""

import numpy as np

from pdhocbf_drake import Robot, load_scenario, simulate
from pdhocbf_drake.estimation import ContactEkf, Memory, Notice, Sample

# The recording; `read_run(folder).log` reads one that `pdhocbf run walking_sensors` has made.
scenario = load_scenario("walking_sensors", "duration: 2.0")
log = simulate(scenario)

estimator = ContactEkf(Robot.load("biped"), scenario.measurement, scenario.tick)
memory, estimates = Memory(), []
for imu, encoders, forces in zip(log["imu"], log["encoders"], log["force_torque"], strict=True):
    # Nothing is raised for what a sensor says, and `memory` is all that the next tick needs.
    memory, estimate = estimator.step(memory, Sample(imu, encoders, forces))
    estimates.append(estimate)
    if notice := Notice(int(estimate.status[0])):
        print(f"{len(estimates)}: {notice.name}")

velocity = np.array([estimate.lip_state[[1, 4]] for estimate in estimates])
error = velocity - log["lip_state"][:, [1, 4]]
x, y = 1e3 * np.sqrt((error[80:] ** 2).mean(axis=0))
print(f"RMS error of the CoM's velocity: {x:.1f} mm/s ahead, {y:.1f} mm/s aside")
print(f"bias of the gyroscope: {np.round(np.degrees(memory.estimate[21:24]), 3)} deg/s")
print(f"CoM from the stance foot: ± {2e3 * estimates[-1].deviation[0]:.1f} mm (2σ)")
