"""The walk's controller as a block of one's own Drake diagram: here it balances a pendulum that Drake integrates."""

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LinearSystem, LogVectorOutput

from pdhocbf_drake import WalkController, load_scenario

scenario = load_scenario("vhip", "gait: {com_height_amplitude: 0.0}")
controller = WalkController.of(scenario)

# One's own plant: c̈ = η (c − p) and ṗ = u along x and y, in continuous time. Its state is c, v, p of x, then of y;
# its input is the port zmp_reference: x_zmp, ux, y_zmp, uy.
eta = 9.81 / scenario.gait.com_height
A = np.kron(np.eye(2), [[0.0, 1.0, 0.0], [eta, 0.0, -eta], [0.0, 0.0, 0.0]])
B = np.kron(np.eye(2), [[0.0, 0.0], [0.0, 0.0], [0.0, 1.0]])

builder = DiagramBuilder()
mpc = builder.AddNamedSystem("controller", controller.system())
plant = builder.AddNamedSystem("plant", LinearSystem(A, B, np.eye(6), np.zeros((6, 4))))
builder.Connect(plant.get_output_port(), mpc.GetInputPort("lip_state"))
builder.Connect(mpc.GetOutputPort("zmp_reference"), plant.get_input_port())
motion = LogVectorOutput(plant.get_output_port(), builder, publish_period=0.5)
status = LogVectorOutput(mpc.GetOutputPort("solver_status"), builder, publish_period=scenario.tick)

simulator = Simulator(builder.Build())
simulator.AdvanceTo(5.0)
rows = motion.FindLog(simulator.get_context())
for time, (x, vx, _, y, *_) in zip(rows.sample_times(), rows.data().T, strict=True):
    print(f"{time:3.1f} s: CoM at {x:5.2f} m, {y:+.3f} m, forward at {vx:.2f} m/s")
reasons = status.FindLog(simulator.get_context()).data()[-1]
print(f"{len(reasons)} ticks, of which {np.count_nonzero(reasons)} were not simply solved")
