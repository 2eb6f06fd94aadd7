"""The path that a walk follows, as it is commanded."""

from __future__ import annotations

from pydrake.systems.framework import BasicVector, Context, LeafSystem

from pdhocbf_drake.systems.gait_reference import gait_after
from pdhocbf_drake.systems.signals import places, size
from pdhocbf_drake.walking import Gait

(_STEP,) = places("gait_phase", "step")


class PathReference(LeafSystem):
    """Outputs the middle between the feet, the heading and the granted command of the present step.

    Input ports:
        gait_phase (3).
        last_step (1), resumed (3): as in `systems.signals`; may be left unconnected.
    Output ports:
        path (7): as in `systems.signals`.
    """

    def __init__(self, gait: Gait) -> None:
        super().__init__()
        self._gait = gait
        ports = [self.DeclareVectorInputPort(name, size(name)) for name in ("gait_phase", "last_step", "resumed")]
        self._phase, self._last, self._resumed = ports
        self.DeclareVectorOutputPort("path", size("path"), self._calc, {port.ticket() for port in ports})

    def _calc(self, context: Context, output: BasicVector) -> None:
        gait = gait_after(self._gait, self._last, self._resumed, context)
        output.SetFromVector(gait.path(round(self._phase.Eval(context)[_STEP])))
