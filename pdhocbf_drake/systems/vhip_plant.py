"""The template as a plant."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from pdhocbf_drake.walking.vhip import Vhip


class VhipPlant(LeafSystem):
    """Both axes of the VHIP (23) as a discrete-time plant.

    Blocks updated at the same instant read each other's old state. So that the input planned at kδ acts during
    [kδ, (k + 1)δ], this plant steps half a tick after the controller.

    Input ports:
        gait_phase (3): where in its period eta is.
        zmp_reference (4): the planned ZMP and its velocity, of which the velocity acts.
        push (3): external force on the mass, of which x and y act: v⁺ = (23) + δ F/m [N]; may be left unconnected.
    Output ports:
        lip_state (6): c, v, p of x, then of y [m, m/s, m].

    Args:
        initial: c, v, p of x, then of y at the start, shape (2, 3).
        mass: m, which turns a push into a change of velocity [kg].
    """

    def __init__(self, vhip: Vhip, initial: np.ndarray, mass: float) -> None:
        super().__init__()
        self._vhip, self._mass = vhip, mass
        self.DeclareVectorInputPort("gait_phase", 3)
        self.DeclareVectorInputPort("zmp_reference", 4)
        self.DeclareVectorInputPort("push", 3)
        state = self.DeclareDiscreteState(np.asarray(initial, dtype=float).ravel())
        self.DeclarePeriodicDiscreteUpdateEvent(vhip.tick, 0.5 * vhip.tick, self._step)
        self.DeclareStateOutputPort("lip_state", state)

    def _step(self, context: Context, values: DiscreteValues) -> None:
        # The clock already speaks of the tick we move towards.
        phase = round(self.GetInputPort("gait_phase").Eval(context)[0]) - 1
        velocity = self.GetInputPort("zmp_reference").Eval(context)[[1, 3]]
        state = context.get_discrete_state_vector().value().reshape(2, 3)
        following = self._vhip.step_axes(phase, state, velocity)
        push = self.GetInputPort("push")
        if push.HasValue(context):
            following[:, 1] += self._vhip.tick * push.Eval(context)[:2] / self._mass
        values.set_value(following.ravel())
