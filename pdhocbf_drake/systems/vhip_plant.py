"""The template as a plant."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues

from pdhocbf_drake.systems.block import Block
from pdhocbf_drake.systems.optional_input import OptionalInput
from pdhocbf_drake.systems.signals import size, stretch
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.uneven_eta import UnevenEta
from pdhocbf_drake.walking.vhip import Vhip

_ZMP_VELOCITY = stretch("zmp_reference", "ux", "uy")
_HORIZONTAL = stretch("push", "fx", "fy")


class VhipPlant(Block):
    """Both axes of the VHIP (23) as a discrete-time plant.

    Blocks updated at the same instant read each other's old state. So that the input planned at kδ acts during
    [kδ, (k + 1)δ], this plant steps half a tick after the controller.

    Input ports:
        gait_phase (3): the tick of the step, which determines eta.
        zmp_reference (4): the planned ZMP and its velocity; the velocity is the input u.
        push (3): external force F on the mass; its horizontal part changes the velocity by δ F/m [N]; may be left
            unconnected.
    Output ports:
        lip_state (6): c, v, p of x, then of y [m, m/s, m].

    Args:
        initial: c, v, p of x, then of y at the start, shape (2, 3).
        mass: m [kg].
        gait: the walk, whose ground determines eta where it is uneven.
    """

    def __init__(self, vhip: Vhip, initial: np.ndarray, mass: float, gait: Gait | None = None) -> None:
        super().__init__()
        self._vhip, self._mass = vhip, mass
        self._eta = UnevenEta(gait) if gait is not None and gait.uneven else None
        self._period = vhip.period
        ports = [self.DeclareVectorInputPort(name, size(name)) for name in ("gait_phase", "zmp_reference", "push")]
        self._phase, self._zmp, push = ports
        self._push = OptionalInput(push)
        state = self.DeclareDiscreteState(np.asarray(initial, dtype=float).ravel())
        self.DeclarePeriodicDiscreteUpdateEvent(vhip.tick, 0.5 * vhip.tick, self._step)
        self.DeclareStateOutputPort("lip_state", state)

    def _step(self, context: Context, values: DiscreteValues) -> None:
        tick, step, _ = self._phase.Eval(context).tolist()
        phase = round(tick) - 1  # half a tick after the clock's update gait_phase is that of the coming tick
        velocity = self._zmp.Eval(context)[_ZMP_VELOCITY]
        state = context.get_discrete_state_vector().value().reshape(2, 3)
        vhip = self._vhip
        if self._eta is not None:
            eta = self._eta(round(step) * self._period + phase, state)
            vhip, phase = Vhip(np.array([eta]), vhip.tick, vhip.flow), 0
        following = vhip.step_axes(phase, state, velocity)
        force = self._push(context)
        if force is not None:
            following[:, 1] += self._vhip.tick * force[_HORIZONTAL] / self._mass
        values.set_value(following.ravel())
