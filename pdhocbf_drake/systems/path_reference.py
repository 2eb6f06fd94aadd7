"""The path that a walk follows, as it is commanded."""

from __future__ import annotations

from pydrake.systems.framework import BasicVector, Context

from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.systems.gait_reference import ChangedGait
from pdhocbf_drake.systems.signals import places, size, sizes
from pdhocbf_drake.walking import Gait

(_STEP,) = places("gait_phase", "step")


class PathReference(Block):
    """Outputs the middle between the feet, the heading, and the command of the present step, granted and asked.

    Input ports:
        gait_phase (3), and those of `ChangedGait`.
    Output parts, see `unbundled`:
        path (7), command_asked (4): as in `systems.signals`.
    """

    def __init__(self, gait: Gait) -> None:
        super().__init__()
        self.parts = sizes("path", "command_asked")
        self._phase = self.DeclareVectorInputPort("gait_phase", size("gait_phase"))
        self._gait = ChangedGait(self, gait)
        prerequisites = {self._phase.ticket(), *self._gait.tickets}
        self.DeclareVectorOutputPort("path_and_command", sum(self.parts.values()), weakly(self._calc), prerequisites)

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self.commanded(round(self._phase.Eval(context)[_STEP]), self._gait(context)))

    def commanded(self, step: int, gait: Gait) -> list[float]:
        """path and command_asked in step j of the gait as it has been changed, (11,)."""
        return [*gait.path(step), *gait.asked(step)]
