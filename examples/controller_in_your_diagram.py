"""The walk's controller as a block of one's own Drake diagram: here it balances a pendulum that Drake integrates."""

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LinearSystem, LogVectorOutput, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from pdhocbf_drake import WalkController, load_scenario

text = "{gait: {com_height_amplitude: 0.0}, commands: [{time: 0, stop: true}]}"
scenario = load_scenario("vhip", text)
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
# In place of a joystick: velocity ahead and to the left [m/s], turn rate [rad/s], and 1 for a stop, each for a while.
commands = np.array([[0.3, 0.0, 0.0, 0.0], [0.2, 0.0, 0.5, 0.0], [0.0, 0.0, 0.0, 1.0]]).T
sender = builder.AddSystem(TrajectorySource(PiecewisePolynomial.ZeroOrderHold([0.0, 3.0, 6.0], commands)))
builder.Connect(sender.get_output_port(), mpc.GetInputPort("command"))
motion = LogVectorOutput(plant.get_output_port(), builder, publish_period=0.5)
status = LogVectorOutput(mpc.GetOutputPort("solver_status"), builder, publish_period=scenario.tick)

simulator = Simulator(builder.Build())
simulator.AdvanceTo(8.0)
rows = motion.FindLog(simulator.get_context())
for time, (x, vx, _, y, vy, _) in zip(rows.sample_times(), rows.data().T, strict=True):
    print(f"{time:3.1f} s: CoM at {x:5.2f} m, {y:+.3f} m, {np.hypot(vx, vy):.2f} m/s fast")
reasons = status.FindLog(simulator.get_context()).data()[-1]
print(f"{len(reasons)} ticks, of which {np.count_nonzero(reasons)} were not simply solved")
