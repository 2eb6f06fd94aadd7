"""The effort of eq. (36): the ZMP velocities, squared."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.mpc.terms.program import AxisProgram
from pdhocbf_drake.mpc.terms.term import Term


class Effort(Term):
    """min Σ_{i < H} u(k + i)²  [m²/s²], the first sum of eq. (36)."""

    axes_alike = True

    def write(self, program: AxisProgram) -> None:
        program.price(2.0 * np.eye(program.horizon), program.u, "effort")
