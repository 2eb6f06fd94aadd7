"""The ZMP's distance from the centre of its box, which is not in eq. (36)."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.terms.program import AxisProgram
from pdhocbf_drake.mpc.terms.term import Term


class ZmpCentre(Term):
    """min price · Σ_i (p(k+i) + offset_i − S_i feet)², with S_i feet the centre of the box at k + i.

    The price is `mpc.zmp_centre_weight` [1/s²]; 0 leaves the term out.
    """

    axes_alike = True

    @classmethod
    def configured(cls, config: MpcConfig) -> bool:
        return config.zmp_centre_weight > 0.0

    def write(self, program: AxisProgram) -> None:
        rows = np.hstack([program.gamma[1:, 2], program.phi[1:, 2], -program.weights, np.eye(program.horizon)])
        variables = np.concatenate([program.u, program.part["state"], program.feet, program.part["zmp_offset"]])
        program.price(2.0 * self.setting.config.zmp_centre_weight * rows.T @ rows, variables, "zmp_centre")
