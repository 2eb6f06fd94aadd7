"""The clock of the walk."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.systems.optional_input import OptionalInput
from pdhocbf_drake.systems.signals import size, sizes
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.course import Course
from pdhocbf_drake.walking.footsteps import Resumed


class ChangedGait:
    """The gait as the controller has changed it.

    Its input ports, which may be left unconnected, are those of a block:
        last_step (1): the step with the last swing, or −1.
        resumed (3): steps in place of a stand.
        course (47): of a walk that follows commands, how far it has come under those of an input port.

    All are as in `systems.signals`.

    Attributes:
        tickets: of the ports, for the block's prerequisites.
    """

    def __init__(self, block: LeafSystem, gait: Gait) -> None:
        self._gait = gait
        names = ("last_step", "resumed", *["course"] * gait.turns)
        ports = [block.DeclareVectorInputPort(name, size(name)) for name in names]
        self.tickets = {port.ticket() for port in ports}
        self._last, self._resumed, *course = map(OptionalInput, ports)
        self._course = course[0] if course else None

    def __call__(self, context: Context) -> Gait:
        """The gait by the values of the ports in a context of the block."""
        last, resumed = self._last(context), self._resumed(context)
        course = None if self._course is None else self._course(context)
        return changed_gait(self._gait, last, resumed, course)


def changed_gait(
    gait: Gait, last_step: np.ndarray | None, resumed: np.ndarray | None, course: np.ndarray | None
) -> Gait:
    """The gait by the values of the ports of `ChangedGait`; None where one has none."""
    if course is not None:
        gait = gait.following(Course.of(course.tolist()))
    if last_step is not None:
        gait = gait.ended_by(last_step[0])
    if resumed is not None:
        tick, side, last = resumed.tolist()
        gait = gait.resumed_by(Resumed(round(tick), round(side), round(last)))
    return gait


class GaitReference(Block):
    """Counts ticks and outputs what the gait commands for the present one.

    Its one discrete state is the tick k. Like every block here it is updated at kδ, so that its outputs between kδ and
    (k + 1)δ are those of tick k + 1, towards which the robot moves.

    Input ports:
        those of `ChangedGait`.
    Output parts, see `unbundled`:
        gait_phase (3): tick of the step, step index, support (+1 left, −1 right, 0 both).
        com_height (3): z, ż, z̈ of eq. (24) [m, m/s, m/s²].
    """

    def __init__(self, gait: Gait) -> None:
        super().__init__()
        self.parts = sizes("gait_phase", "com_height")
        self._period = gait.period
        self._commanded = np.array([[tick, 0.0, 0.0, *gait.height(tick)] for tick in range(gait.period)])
        self._gait = ChangedGait(self, gait)
        self.DeclareDiscreteState(1)
        self.DeclarePeriodicDiscreteUpdateEvent(gait.config.tick, 0.0, self._advance)
        prerequisites = {self.xd_ticket(), *self._gait.tickets}
        self.DeclareVectorOutputPort("commanded", sum(self.parts.values()), weakly(self._calc), prerequisites)

    def _advance(self, context: Context, values: DiscreteValues) -> None:
        values.set_value(context.get_discrete_state_vector().value() + 1.0)

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self.commanded(round(context.get_discrete_state_vector()[0]), self._gait(context)))

    def commanded(self, tick: int, gait: Gait) -> np.ndarray:
        """gait_phase and com_height at tick k of the gait as it has been changed, (6,)."""
        step, phase = divmod(tick, self._period)
        commanded = self._commanded[phase].copy()
        commanded[1], commanded[2] = step, gait.support(step)
        return commanded
