"""A barrier's rows over the horizon, eq. (26)."""

from __future__ import annotations

from collections.abc import Hashable, Mapping

import numpy as np

from pdhocbf_drake.barriers import AffineBarrier, Linear, affine_rows
from pdhocbf_drake.mpc.terms.program import AxisProgram
from pdhocbf_drake.mpc.terms.term import RowKind, Setting, Term, Tick


class BarrierTerm(Term):
    """ψ_m(k+i) + slack_i ≥ 0, i = 0 … H − m, eq. (26), of one barrier.

    A soft barrier has a slack_i ≥ 0 for each row, at the price `mpc.slack_weight`: linear · slack + quadratic · slack².
    A hard one has none.

    Parameters: bound_NAME, the samples V̄(k) … V̄(k+H), (H + 1,) [unit of h].
    """

    axes_alike = True

    def __init__(self, setting: Setting, barrier: AffineBarrier, soft: bool) -> None:
        super().__init__(setting)
        self.barrier, self._soft = barrier, soft
        self._part, self._name = f"bound_{barrier.name}", f"barrier {barrier.name}"

    @classmethod
    def of(cls, setting: Setting) -> list[Term]:
        return [cls(setting, barrier, setting.config.barrier == "soft") for barrier in setting.barriers]

    @property
    def row_kinds(self) -> Mapping[str, RowKind]:
        return {self._name: RowKind("tick"), f"slack {self.barrier.name}": RowKind("tick", is_bound=True)}

    @property
    def sizes(self) -> dict[str, int]:
        return {self._part: self.setting.config.horizon + 1}

    @property
    def slacks(self) -> int:
        rows = affine_rows(self.barrier, self.setting.vhip.system, 0, self.setting.config.horizon)
        return int(np.count_nonzero(rows.reachable))

    @property
    def key(self) -> Hashable:
        b = self.barrier
        return super().key, self._soft, b.name, b.normal.tobytes(), b.sign, b.class_k, b.relative_degree

    def write(self, program: AxisProgram) -> None:
        barrier, horizon = self.barrier, program.horizon
        normals = barrier.normals(program.phase, horizon + 1)[:, None]
        along = (normals @ program.phi)[:, 0], (normals @ program.gamma)[:, 0], np.zeros(horizon + 1)
        psi = affine_rows(barrier, self.setting.vhip.system, program.phase, horizon, along)
        keep = psi.reachable  # the others are facts about the present that no input changes
        rows = int(np.count_nonzero(keep))
        count = rows if self._soft else 0
        slack = program.new_slacks(count, f"slack_{barrier.name}")
        lhs = np.hstack([psi.inputs[keep], psi.state[keep], psi.bounds[keep], np.eye(rows, count)])
        variables = np.concatenate([program.u, program.part["state"], program.part[self._part], slack])
        program.at_least(lhs, variables, self._name, -psi.constant[keep])
        if self._soft:
            linear, quadratic = self.setting.config.slack_weight
            program.price(2.0 * quadratic * np.eye(count), slack, "slack", np.full(count, linear))
            program.at_least(np.eye(count), slack, f"slack {barrier.name}")

    def fill_tick(self, tick: Tick, theta: np.ndarray) -> None:
        theta[self.places[self._part]] = tick.bounds[self.barrier.name]

    def softened(self) -> Term:
        other = BarrierTerm(self.setting, self.barrier, True)
        other.places = self.places
        return other

    def relaxed(self) -> Term:
        """Soft, and with γ = 1 throughout: ψ_m ≥ 0 then says no more than h(k + m) ≥ 0."""
        b = self.barrier
        undecayed = AffineBarrier(b.name, b.normal, b.bound, b.sign, [Linear(1.0)] * b.order, b.unit, b.relative_degree)
        other = BarrierTerm(self.setting, undecayed, True)
        other.places = self.places
        return other
