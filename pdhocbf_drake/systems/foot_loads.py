"""The ground's vertical force on each foot."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import ContactResults, MultibodyPlant
from pydrake.systems.framework import BasicVector, Context

from pdhocbf_drake.estimation.sample import Notice
from pdhocbf_drake.robot import SIDES, Biped
from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.systems.signals import places, size

_WORLD = 0  # index of the body that the ground is
_FORCES = places("force_torque", "left_fz", "right_fz")
(_NOTICE,) = places("estimator_status", "notice")
_WRONG = int(Notice.FORCE_TORQUE | Notice.FLICKER)


class FootLoads(Block):
    """Sums the vertical forces of all point contacts between the ground and what is welded to a foot.

    Input ports:
        contact_results: of the plant.
    Output ports:
        foot_load (2): as in `systems.signals`.
    """

    def __init__(self, plant: MultibodyPlant, biped: Biped) -> None:
        super().__init__()
        self._feet: dict[int, int] = {}
        for foot, side in enumerate(SIDES):
            sole = plant.GetBodyByName(biped.soles[side].frame.body().name())
            self._feet |= {int(body.index()): foot for body in plant.GetBodiesWeldedTo(sole)}
        self._contacts = self.DeclareAbstractInputPort("contact_results", AbstractValue.Make(ContactResults()))
        self.DeclareVectorOutputPort("foot_load", size("foot_load"), weakly(self._calc))

    def _calc(self, context: Context, output: BasicVector) -> None:
        contacts, loads = self._contacts.Eval(context), np.zeros(size("foot_load"))
        for i in range(contacts.num_point_pair_contacts()):
            contact = contacts.point_pair_contact_info(i)
            one, other, up = int(contact.bodyA_index()), int(contact.bodyB_index()), contact.contact_force()[2]
            if one == _WORLD and other in self._feet:  # the force is that on the second body
                loads[self._feet[other]] += up
            elif other == _WORLD and one in self._feet:
                loads[self._feet[one]] -= up
        output.SetFromVector(loads)


class SensedLoads(Block):
    """The forces above the soles, across them: on a tilted sole a little less than the vertical ones.

    Where the estimator finds a force sensor wrong, NaN: what is not trusted is not felt.

    Input ports:
        force_torque (12), estimator_status (8): as in `systems.signals`.
    Output ports:
        foot_load_estimate (2): likewise.
    """

    def __init__(self) -> None:
        super().__init__()
        names = "force_torque", "estimator_status"
        self._forces, self._status = (self.DeclareVectorInputPort(name, size(name)) for name in names)
        self.DeclareVectorOutputPort("foot_load_estimate", size("foot_load_estimate"), weakly(self._calc))

    def _calc(self, context: Context, output: BasicVector) -> None:
        loads = self._forces.Eval(context)[_FORCES]
        wrong = round(self._status.Eval(context)[_NOTICE]) & _WRONG
        output.SetFromVector(np.full(len(loads), np.nan) if wrong else loads)
