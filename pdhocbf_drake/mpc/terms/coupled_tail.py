"""The periodic tail of a walk that turns: the end of a plan is its start, turned."""

from __future__ import annotations

import math

from pdhocbf_drake.mpc.terms.stability import Stability
from pdhocbf_drake.mpc.terms.term import Setting, Term, Tick


class CoupledTail(Stability):
    """The stability row with e_{k+H} = R e_k, R the rotation by the angle that the walk turns within a horizon.

    In the frame of the stance foot a walk that turns is periodic up to this rotation; each axis then needs e of the
    other one, which enters its tail parameter alone, so that rows and matrices are those of `Stability`.
    """

    def __init__(self, setting: Setting) -> None:
        super().__init__(setting)
        c, s = math.cos(setting.turn), math.sin(setting.turn)
        self._row = ((c, -s), (s, c))[setting.axis]  # of R

    @classmethod
    def of(cls, setting: Setting) -> list[Term]:
        return [cls(setting)] if setting.turn else []

    def periodic_tail(self, tick: Tick) -> float:
        """Π λ⁻¹ (R e_k) of this axis [m]."""
        return self._discount[tick.phase] * (self._row[0] * tick.error[0] + self._row[1] * tick.error[1])
