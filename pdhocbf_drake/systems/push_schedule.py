"""External forces on bodies at given times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem


class TimedForce(NamedTuple):
    """A constant force [N] (3,), world axes, on a point of a body [m] (3,), during ticks first … last − 1."""

    body: BodyIndex
    point: np.ndarray
    force: np.ndarray
    first: int
    last: int


class PushSchedule(LeafSystem):
    """Applies forces to the plant; its discrete state is the tick whose interval is running.

    Output ports:
        applied_spatial_force: list of `ExternallyAppliedSpatialForce`.
        push (3): sum of the forces that act now [N].
    """

    def __init__(self, forces: Sequence[TimedForce], tick: float) -> None:
        super().__init__()
        self._forces = tuple(forces)
        self.DeclareDiscreteState([-1.0])
        self.DeclarePeriodicDiscreteUpdateEvent(tick, 0.0, self._advance)
        state = {self.xd_ticket()}
        model = Value[list[ExternallyAppliedSpatialForce]]
        self.DeclareAbstractOutputPort("applied_spatial_force", lambda: model([]), self._applied, state)
        self.DeclareVectorOutputPort("push", 3, self._sum, state)

    def _advance(self, context: Context, values: DiscreteValues) -> None:
        values.set_value([context.get_discrete_state_vector()[0] + 1.0])

    def _active(self, context: Context) -> list[TimedForce]:
        tick = round(context.get_discrete_state_vector()[0])
        return [force for force in self._forces if force.first <= tick < force.last]

    def _applied(self, context: Context, value: AbstractValue) -> None:
        applied = []
        for force in self._active(context):
            entry = ExternallyAppliedSpatialForce()
            entry.body_index = force.body
            entry.p_BoBq_B = force.point
            entry.F_Bq_W = SpatialForce(tau=np.zeros(3), f=force.force)
            applied.append(entry)
        value.set_value(applied)

    def _sum(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(sum((force.force for force in self._active(context)), np.zeros(3)))
