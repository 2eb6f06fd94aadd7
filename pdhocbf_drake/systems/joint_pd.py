"""Joint control at the plant's rate, all of it Drake's own C++ blocks."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import (
    Adder,
    ConstantVectorSource,
    Demultiplexer,
    DiscreteTimeIntegrator,
    MatrixGain,
    Multiplexer,
    Saturation,
)

from pdhocbf_drake.biped import Biped


def joint_pd(biped: Biped, initial: np.ndarray, time_step: float) -> Diagram:
    """τ = sat(kp (q* − q) + kd (q̇* − q̇) + feedforward), with targets that move evenly between ticks.

    Input ports:
        desired_state (24): targets and rates; the rates are integrated at the plant's step, so that targets don't jump.
        estimated_state (24): joint positions and velocities [rad, rad/s].
        feedforward (12) [N m].
    Output ports:
        actuation (12), within the effort limits [N m].

    Args:
        initial: joint positions at the start (12,) [rad].
        time_step: the plant's [s].
    """
    builder = DiagramBuilder()
    split = builder.AddNamedSystem("split", Demultiplexer([12, 12]))
    # The integrator starts from zero in every context, so it holds the way moved from the initial posture.
    moved = builder.AddNamedSystem("moved", DiscreteTimeIntegrator(12, time_step))
    start = builder.AddNamedSystem("start", ConstantVectorSource(np.concatenate([initial, np.zeros(12)])))
    desired = builder.AddNamedSystem("desired", Multiplexer([12, 12]))
    error = builder.AddNamedSystem("error", Adder(3, 24))
    measured = builder.AddNamedSystem("measured", MatrixGain(-np.eye(24)))
    gains = builder.AddNamedSystem("gains", MatrixGain(np.hstack([np.diag(biped.kp), np.diag(biped.kd)])))
    total = builder.AddNamedSystem("total", Adder(2, 12))
    limit = builder.AddNamedSystem("limit", Saturation(-biped.effort_limits, biped.effort_limits))
    builder.Connect(split.get_output_port(1), moved.get_input_port())
    builder.Connect(moved.get_output_port(), desired.get_input_port(0))
    builder.Connect(split.get_output_port(1), desired.get_input_port(1))
    builder.Connect(desired.get_output_port(), error.get_input_port(0))
    builder.Connect(measured.get_output_port(), error.get_input_port(1))
    builder.Connect(start.get_output_port(), error.get_input_port(2))
    builder.Connect(error.get_output_port(), gains.get_input_port())
    builder.Connect(gains.get_output_port(), total.get_input_port(0))
    builder.Connect(total.get_output_port(), limit.get_input_port())
    builder.ExportInput(split.get_input_port(), "desired_state")
    builder.ExportInput(measured.get_input_port(), "estimated_state")
    builder.ExportInput(total.get_input_port(1), "feedforward")
    builder.ExportOutput(limit.get_output_port(), "actuation")
    diagram = builder.Build()
    diagram.set_name("joint_pd")
    return diagram
