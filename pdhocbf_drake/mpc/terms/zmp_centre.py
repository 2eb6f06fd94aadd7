"""The ZMP's distance from the centre of its box, which is not in eq. (36)."""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np

from pdhocbf_drake.mpc.terms.program import AxisProgram
from pdhocbf_drake.mpc.terms.term import Setting, Term


class ZmpCentre(Term):
    """min price · Σ_i (p(k+i) + offset_i − S_i feet)², with S_i feet the centre of the box at k + i.

    The price is `mpc.zmp_centre_weight`, in y `mpc.sway_weight` where there is one [1/s²]; 0 leaves the term out.
    """

    axes_alike = True

    def __init__(self, setting: Setting) -> None:
        super().__init__(setting)
        config = setting.config
        own = config.sway_weight if self.axis else None
        self.price = config.zmp_centre_weight if own is None else own

    @classmethod
    def of(cls, setting: Setting) -> list[Term]:
        term = cls(setting)
        return [term] if term.price else []

    @property
    def key(self) -> Hashable:
        return super().key, self.price

    def write(self, program: AxisProgram) -> None:
        rows = np.hstack([program.gamma[1:, 2], program.phi[1:, 2], -program.weights, np.eye(program.horizon)])
        variables = np.concatenate([program.u, program.part["state"], program.feet, program.part["zmp_offset"]])
        program.price(2.0 * self.price * rows.T @ rows, variables, "zmp_centre")
