"""The estimator as a block, and its errors where the truth is known."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from pdhocbf_drake.estimation.base_filter import BaseFilter
from pdhocbf_drake.estimation.errors import write_errors
from pdhocbf_drake.estimation.memory import SIZE, Memory
from pdhocbf_drake.estimation.sample import Sample
from pdhocbf_drake.robot.config import SIDES
from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.systems.optional_input import OptionalInput
from pdhocbf_drake.systems.signals import places, size, sizes

_INPUTS = ("imu", "encoders", "force_torque")
_OUTPUTS = (
    "lip_estimate",
    "com_z_estimate",
    "foot_estimate",
    "estimate_deviation",
    "estimator_status",
    "base_estimate",
)
(_SUPPORT,) = places("gait_phase", "support")
(_HELD,) = places("estimator_status", "held")
_PLACES = [places("foot_state", f"{side}_x", f"{side}_y") for side in SIDES]


class BaseEstimator(Block):
    """CoM, ZMP and soles from the sensors of a tick (Remark 8), see `estimation.base_filter`.

    The filter's memory is this block's discrete state, so that a context can be copied and continued. The outputs are
    of the sensors' present sample: an estimate that is read a tick later costs a third of the walk's speed.

    Input ports:
        imu (9), encoders (24), force_torque (12): as in `systems.signals`.
        desired_state (24), gait_phase (3): likewise; stand in for sensors that fail, and may be left unconnected.
    Output parts, see `unbundled`:
        lip_estimate (6), com_z_estimate (2), foot_estimate (12), estimate_deviation (6), estimator_status (8),
        base_estimate (27): as in `systems.signals`.
        estimator_memory: `Memory.vector` after this tick.

    Args:
        tick: δ [s].
    """

    def __init__(self, estimator: BaseFilter, tick: float) -> None:
        super().__init__()
        self._estimator, self.parts = estimator, {**sizes(*_OUTPUTS), "estimator_memory": SIZE}
        ports = [self.DeclareVectorInputPort(name, size(name)) for name in (*_INPUTS, "desired_state", "gait_phase")]
        self._imu, self._encoders, self._forces = ports[:3]
        self._targets, self._phase = map(OptionalInput, ports[3:])
        self.DeclareDiscreteState(Memory().vector)
        self.DeclarePeriodicDiscreteUpdateEvent(tick, 0.0, self._update)
        prerequisites = {self.xd_ticket(), *(port.ticket() for port in ports)}
        self._estimate = self.DeclareVectorOutputPort(
            "estimate", sum(self.parts.values()), weakly(self._calc), prerequisites
        )

    def _update(self, context: Context, values: DiscreteValues) -> None:
        values.set_value(self._estimate.Eval(context)[-SIZE:])

    def _calc(self, context: Context, output: BasicVector) -> None:
        memory = Memory(context.get_discrete_state_vector().value())
        targets, phase = self._targets(context), self._phase(context)
        support = None if phase is None else float(phase[_SUPPORT])
        inputs = self._imu.Eval(context), self._encoders.Eval(context), self._forces.Eval(context)
        memory, estimate = self._estimator.step(memory, Sample(*inputs, targets, support))
        output.SetFromVector(np.concatenate([*estimate, memory.estimate, memory.vector]))


class EstimateErrors(Block):
    """Errors of what can be observed, and their normalized square, from the true state; see `estimation.errors`.

    Input ports:
        estimator_memory: of `BaseEstimator`.
        robot_state (37), foot_state (12): true.
    Output ports:
        estimate_error (9): as in `systems.signals`.

    Args:
        base: places of the base's quaternion and position in q (7,).
        velocity: places of the base's velocity in robot_state (3,).
    """

    def __init__(self, base: np.ndarray, velocity: np.ndarray) -> None:
        super().__init__()
        self._base, self._velocity = base, velocity
        self._memory = self.DeclareVectorInputPort("estimator_memory", SIZE)
        self._state = self.DeclareVectorInputPort("robot_state", size("robot_state"))
        self._feet = self.DeclareVectorInputPort("foot_state", size("foot_state"))
        self.DeclareVectorOutputPort("estimate_error", size("estimate_error"), weakly(self._calc))

    def _calc(self, context: Context, output: BasicVector) -> None:
        state, feet = self._state.Eval(context), self._feet.Eval(context).reshape(2, 6)
        errors = np.empty(size("estimate_error"))
        memory = Memory(self._memory.Eval(context))
        write_errors(memory, state[self._base], state[self._velocity], feet[:, :3], errors)
        output.SetFromVector(errors)


class TrueState(Block):
    """The true state as the plan counts it: c and p from where the stance foot is estimated, not from where it is.

    Where a robot stands can't be observed, so the estimated world, in which it is planned, drifts from the true one.

    Input ports:
        lip_state (6), foot_state (12): true.
        foot_estimate (12), estimator_status (8): of `BaseEstimator`.
    Output ports:
        true_state (6): as lip_state.
    """

    def __init__(self) -> None:
        super().__init__()
        names = ("lip_state", "foot_state", "foot_estimate", "estimator_status")
        self._ports = [self.DeclareVectorInputPort(name, size(name)) for name in names]
        self.DeclareVectorOutputPort("true_state", size("lip_state"), weakly(self._calc))

    def _calc(self, context: Context, output: BasicVector) -> None:
        state, feet, estimate, status = (port.Eval(context) for port in self._ports)
        foot = _PLACES[int(status[_HELD] > 0.5)]
        x, y = (estimate[foot] - feet[foot]).tolist()
        output.SetFromVector(state + np.array([x, 0.0, x, y, 0.0, y]))
