"""The periodic tail of a walk that turns: the end of a plan is its start, turned."""

from __future__ import annotations

import math

from pdhocbf_drake.mpc.terms.stability import Stability
from pdhocbf_drake.mpc.terms.term import Setting, Term, Tick


class CoupledTail(Stability):
    """The stability row with e_{k+H} = R e_k, R the rotation by the angle that the walk turns within a horizon.

    In the frame of the stance foot a walk that turns is periodic up to this rotation; each axis then needs e of the
    other one, which enters its tail parameter alone, so that rows and matrices are those of `Stability`. The angle is
    the commanded one, or where the setting has one, that.
    """

    @classmethod
    def of(cls, setting: Setting) -> list[Term]:
        return [cls(setting)] if setting.turn or setting.gait.turns else []

    def periodic_tail(self, tick: Tick) -> float:
        """Π λ⁻¹ (R e_k) of this axis [m]."""
        turn = self.setting.turn or tick.ahead.turn
        c, s = math.cos(turn), math.sin(turn)
        x, y = tick.error
        return self._discount[tick.phase] * (s * x + c * y if self.axis else c * x - s * y)
