"""The footholds' distance from the commanded ones, eq. (36)."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.mpc.commanded import Commanded
from pdhocbf_drake.mpc.terms.program import AxisProgram
from pdhocbf_drake.mpc.terms.term import Setting, Term, Tick


class Footholds(Term):
    """min ε Σ_j (f_j − f*_j)², the second sum of eq. (36), with ε = `mpc.foothold_weight` [1/s²].

    The targets f* are the commanded moves from where the stance foot is, and from there at most `mpc.path_correction`
    towards the commanded path; in x on uneven ground they lie inside the window of each footstep.

    Parameters: target (n_f,) [m].
    """

    axes_alike = True

    def __init__(self, setting: Setting) -> None:
        super().__init__(setting)
        self._correction = setting.config.path_correction[setting.axis]

    @property
    def sizes(self) -> dict[str, int]:
        return {"target": self.setting.config.horizon // self.setting.gait.period}

    def write(self, program: AxisProgram) -> None:
        eye = np.eye(len(program.f))
        missed = np.hstack([eye, -eye])
        hessian = 2.0 * self.setting.config.foothold_weight * missed.T @ missed
        program.price(hessian, np.concatenate([program.f, program.part["target"]]), "foothold")

    def fill_step(self, step: int, ahead: Commanded, theta: np.ndarray) -> None:
        theta[self.places["target"]] = np.cumsum(ahead.moves[self.axis])

    def fill_tick(self, tick: Tick, theta: np.ndarray) -> None:
        axis, most = self.axis, self._correction
        here = tick.here[axis]
        away = tick.ahead.centre[axis] - here
        shift = here + (most if away > most else -most if away < -most else away)
        targets = self.places["target"]
        for place in range(targets.start, targets.stop):  # a few numbers, faster one by one
            theta[place] += shift
        if axis == 0 and tick.ahead.windows is not None:
            theta[targets] = np.clip(theta[targets], *tick.ahead.windows.T)
