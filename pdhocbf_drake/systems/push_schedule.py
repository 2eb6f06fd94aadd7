"""External forces on bodies at given times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.systems.signals import size


class TimedForce(NamedTuple):
    """A constant force [N] (3,), world axes, on a point of a body [m] (3,), during ticks first … last − 1."""

    body: BodyIndex
    point: np.ndarray
    force: np.ndarray
    first: int
    last: int


class PushSchedule(Block):
    """Applies forces to the plant; its discrete state is the present tick.

    Each force is a numeric parameter of the context (force, first, last), so that one diagram serves for many pushes,
    see `push`.

    Output ports:
        applied_spatial_force: list of `ExternallyAppliedSpatialForce`.
        push (3): sum of the forces that act now [N].
    """

    def __init__(self, forces: Sequence[TimedForce], tick: float) -> None:
        super().__init__()
        self._forces = tuple(forces)
        for force in self._forces:
            self.DeclareNumericParameter(BasicVector([*force.force, force.first, force.last]))
        self.DeclareDiscreteState([-1.0])
        self.DeclarePeriodicDiscreteUpdateEvent(tick, 0.0, self._advance)
        state = {self.xd_ticket(), self.all_parameters_ticket()}
        model = Value[list[ExternallyAppliedSpatialForce]]
        self.DeclareAbstractOutputPort("applied_spatial_force", lambda: model([]), weakly(self._applied), state)
        self.DeclareVectorOutputPort("push", size("push"), weakly(self._sum), state)

    def _advance(self, context: Context, values: DiscreteValues) -> None:
        values.set_value([context.get_discrete_state_vector()[0] + 1.0])

    def push(self, context: Context, index: int, force: np.ndarray, first: int, last: int) -> None:
        """Replaces a force [N] (3,) and its ticks in one context."""
        context.get_mutable_numeric_parameter(index).SetFromVector([*force, first, last])

    def _active(self, context: Context) -> list[tuple[TimedForce, np.ndarray]]:
        """The forces of this tick: their points of application, and the forces (3,) [N]."""
        tick = round(context.get_discrete_state_vector()[0])
        values = [context.get_numeric_parameter(i).value() for i in range(len(self._forces))]
        pairs = zip(self._forces, values, strict=True)
        return [(place, value[:3]) for place, value in pairs if value[3] <= tick < value[4]]

    def _applied(self, context: Context, value: AbstractValue) -> None:
        applied = []
        for place, force in self._active(context):
            entry = ExternallyAppliedSpatialForce()
            entry.body_index = place.body
            entry.p_BoBq_B = place.point
            entry.F_Bq_W = SpatialForce(tau=np.zeros(3), f=force)
            applied.append(entry)
        value.set_value(applied)

    def _sum(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(sum((force for _, force in self._active(context)), np.zeros(3)))
