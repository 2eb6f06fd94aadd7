"""A barrier's rows over the horizon, eq. (26)."""

from __future__ import annotations

from collections.abc import Hashable, Mapping

import numpy as np

from pdhocbf_drake.barriers import AffineBarrier, Linear, affine_rows
from pdhocbf_drake.barriers.bounds import repeated
from pdhocbf_drake.mpc.robust import nearer_bound
from pdhocbf_drake.mpc.terms.program import AxisProgram
from pdhocbf_drake.mpc.terms.term import RowKind, Setting, Term, Tick
from pdhocbf_drake.walking.walk_barrier import WalkBarrier


def rows_of(name: str) -> str:
    """The name of a barrier's rows in the programs of its axis."""
    return f"barrier {name}"


class BarrierTerm(Term):
    """ψ_m(k+i) + slack_i ≥ 0, i = 0 … H − m, eq. (26), of one barrier.

    A soft barrier has a slack_i ≥ 0 for each row, at the price `mpc.slack_weight`: linear · slack + quadratic · slack².
    A hard one has none.

    A barrier on a quantity that is seen from the stance foot has a column for each coming foothold, a decision. Where
    another foot becomes the stance, and h is seen anew, the recursion starts again, see `affine_rows`.

    Under `mpc.robust` the bound is nearer, by t of (R4) in docs/robust.md, so that h ≥ 0 holds for the true state.

    Parameters: bound_NAME, the samples V̄(k) … V̄(k+H), (H + 1,) [unit of h].
    """

    axes_alike = True

    def __init__(self, setting: Setting, barrier: AffineBarrier, soft: bool) -> None:
        super().__init__(setting)
        self.barrier, self._soft = barrier, soft
        self._seen_anew = isinstance(barrier, WalkBarrier) and barrier.seen_anew
        self._part, self._name = f"bound_{barrier.name}", rows_of(barrier.name)
        nearer = nearer_bound(barrier, setting.vhip, setting.config, setting.axis)
        count = setting.config.horizon + 1
        self._less = None if nearer is None else [barrier.sign * repeated(nearer, k, count) for k in range(len(nearer))]

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
        gains = _foot_gains(b, 0, b.normal_period).tobytes()
        return (
            super().key,
            self._soft,
            b.name,
            b.normal.tobytes(),
            b.sign,
            b.class_k,
            b.relative_degree,
            gains,
            self._seen_anew,
        )

    @property
    def period(self) -> int:
        return self.barrier.normal_period

    def write(self, program: AxisProgram) -> None:
        barrier, horizon = self.barrier, program.horizon
        normals = barrier.normals(program.tick, horizon + 1)[:, None]
        along = (normals @ program.phi)[:, 0], (normals @ program.gamma)[:, 0], np.zeros(horizon + 1)
        restarts = range(program.period - program.phase, horizon + 1, program.period) if self._seen_anew else ()
        psi = affine_rows(barrier, self.setting.vhip.system, program.tick, horizon, along, restarts)
        keep = psi.reachable  # the others are facts about the present that no input changes
        rows = int(np.count_nonzero(keep))
        count = rows if self._soft else 0
        slack = program.new_slacks(count, f"slack_{barrier.name}")
        gains = _foot_gains(barrier, program.tick, horizon + 1)
        parts = [psi.inputs, psi.state, psi.bounds]
        variables = [program.u, program.part["state"], program.part[self._part]]
        if np.any(gains):  # in the world the stance foot adds to the bound
            parts.append(psi.bounds @ (gains[:, None] * program.stances))
            variables.append(program.feet)
        lhs = np.hstack([*(part[keep] for part in parts), np.eye(rows, count)])
        program.at_least(lhs, np.concatenate([*variables, slack]), self._name, -psi.constant[keep])
        if self._soft:
            linear, quadratic = self.setting.config.slack_weight
            program.price(2.0 * quadratic * np.eye(count), slack, "slack", np.full(count, linear))
            program.at_least(np.eye(count), slack, f"slack {barrier.name}")

    def fill_tick(self, tick: Tick, theta: np.ndarray) -> None:
        bound = tick.bounds[self.barrier.name]
        theta[self.places[self._part]] = (
            bound if self._less is None else bound - self._less[tick.tick % len(self._less)]
        )

    def softened(self) -> Term:
        other = BarrierTerm(self.setting, self.barrier, True)
        other.places = self.places
        return other

    def relaxed(self) -> Term:
        """Soft, and with γ = 1 throughout: ψ_m ≥ 0 then says no more than h(k + m) ≥ 0."""
        other = BarrierTerm(self.setting, self.barrier.with_class_k([Linear(1.0)] * self.barrier.order), True)
        other.places = self.places
        return other


def _foot_gains(barrier: AffineBarrier, k: int, count: int) -> np.ndarray:
    """What a metre of the stance foot's place adds to V̄(k), …; nothing where the barrier is one in the world."""
    return barrier.foot_gains(k, count) if isinstance(barrier, WalkBarrier) else np.zeros(count)
