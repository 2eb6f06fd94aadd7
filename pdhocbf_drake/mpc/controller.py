"""The periodic MPC as a function: measured state and last plan in, new plan out. It never raises in the loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy

import numpy as np

from pdhocbf_drake.barriers import AffineBarrier
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.jit import compiled
from pdhocbf_drake.mpc.axis_program import Parameters
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.plan import Plan
from pdhocbf_drake.mpc.program_cache import ProgramCache
from pdhocbf_drake.mpc.programs import Programs
from pdhocbf_drake.mpc.recovery import recovery_of
from pdhocbf_drake.mpc.solution import CONSTRAINTS, NOTICED, Reason
from pdhocbf_drake.mpc.steps import StepPreview
from pdhocbf_drake.mpc.terminal_set import TerminalSet
from pdhocbf_drake.mpc.theta import Theta
from pdhocbf_drake.mpc.unmet import slack_by_barrier, slack_starts, unmet
from pdhocbf_drake.qp.compiled import ParametricQp
from pdhocbf_drake.qp.result import QpResult
from pdhocbf_drake.qp.solvers import QpSolver
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.divergent import DivergentComponent
from pdhocbf_drake.walking.vhip import Vhip


class PeriodicMpc:
    """Problem (36) for every phase of the step, compiled at start (that of a disturbed walk, when first needed).

    Attributes:
        barriers: the barriers of the axes x and y.
        terminal: the terminal sets (20f) of the axes, by axis; none where the tail is demanded instead.
        vhip, divergent: the template and its divergent component.
        qps: `qps[axis][phase]`, the compiled programs.
        theta: their parameters, `theta(axis, tick, …)`.

    Raises:
        InputError: the horizon is not a multiple of the gait (Lemma 2), or a barrier is of another kind.
    """

    def __init__(
        self,
        gait: Gait,
        vhip: Vhip,
        config: MpcConfig,
        barriers: tuple[Sequence[AffineBarrier], Sequence[AffineBarrier]],
        terminal: Mapping[int, TerminalSet] | None = None,
        cache: ProgramCache | None = None,
        on_demand: bool = False,
    ) -> None:
        """Compiles every phase, except for what the cache has from other controllers.

        What a disturbed walk is planned with is compiled phase by phase when it is first needed, since most walks
        never need it: some 10 ms at each of the first N disturbed ticks. Where ticks must be on time, call `prepare`.

        Args:
            cache: what other controllers have compiled. on_demand: compile each phase when it is first needed.
        """
        cache = cache or ProgramCache()
        gait_ticks = gait.config.ticks_per_gait
        if config.horizon % gait_ticks:
            raise InputError(
                f"mpc.horizon: Lemma 2 needs a multiple of the gait's {gait_ticks} ticks (two steps), "
                f"such as {gait_ticks} or {2 * gait_ticks} (given: {config.horizon})"
            )
        self.gait, self.vhip, self.config, self.barriers = gait, vhip, config, barriers
        self.divergent = DivergentComponent(vhip)
        self.footholds = config.horizon // gait.period
        self.terminal = dict(terminal or {})
        names = ([b.name for b in barriers[0]], [b.name for b in barriers[1]])
        ends = [self.terminal[axis].period // gait.period if axis in self.terminal else 0 for axis in (0, 1)]
        self.theta = Theta(gait, config, self.divergent, names, (ends[0], ends[1]))
        self.recovery: PeriodicMpc | None = None
        self.programs = Programs(gait, vhip, self.divergent, config, barriers, self.terminal)
        compiled = [self.programs.compiled(axis, cache) for axis in (0, 1)]
        self.qps: list[Sequence[ParametricQp]] = [axis.qps for axis in compiled]
        self._solvers: list[Sequence[QpSolver]] = [axis.solvers for axis in compiled]
        if not on_demand:
            self.prepare()
        # A terminal set has more facets at some phases than at others; without one all phases have the same rows.
        self.rows = [len(qps[0].A) if on_demand else max(len(qp.A) for qp in qps) for qps in self.qps]
        self._rungs = self.programs.rungs(self.qps)
        self._slack_starts = [slack_starts(barriers[axis], vhip, config.horizon) for axis in (0, 1)]
        if config.recovery is not None:
            self.recovery = PeriodicMpc(*recovery_of(gait, vhip, config), barriers, None, cache, on_demand=True)
            self.rows = [max(pair) for pair in zip(self.rows, self.recovery.rows, strict=True)]
            self.recovery.rows = self.rows
        self._endings: dict[int, PeriodicMpc] = {}
        # One period and a horizon of each bound, so that the samples from any tick on stand in one piece.
        self._bounds = [
            (b.name, b.bound.period, b.bound.samples(0, b.bound.period + config.horizon + 1))
            for b in (*barriers[0], *barriers[1])
        ]

    @property
    def preview(self) -> StepPreview:
        """What the gait commands over the horizon."""
        return self.theta.preview

    @property
    def layouts(self) -> list[Parameters]:
        """Where each part of θ lies, by axis."""
        return self.theta.layouts

    def prepare(self) -> None:
        """Compiles whatever is not compiled yet, the programs of a disturbed walk included."""
        self.qps = [list(axis) for axis in self.qps]
        self._solvers = [list(axis) for axis in self._solvers]
        if self.recovery is not None:
            self.recovery.prepare()

    @property
    def constraints(self) -> tuple[str, ...]:
        """What a plan may miss on each axis, in the order of `Plan.unmet`."""
        return CONSTRAINTS

    def bounds(self, tick: int) -> dict[str, np.ndarray]:
        """V̄(k) … V̄(k + H) of each barrier by name, shape (H + 1,) [unit of h]."""
        count = self.config.horizon + 1
        return {name: samples[tick % period :][:count] for name, period, samples in self._bounds}

    def ended_by(self, last_step: float) -> PeriodicMpc:
        """This problem, or where a last step has been set (not −1), that of the walk that ends there."""
        return self if last_step < 0 else self.ending_at(round(last_step))

    def ending_at(self, step: int) -> PeriodicMpc:
        """The same problem for a walk whose last swing is that of step j."""
        if step not in self._endings:
            other = self._endings[step] = copy(self)
            other.gait = self.gait.ending_at(step)
            other.theta = self.theta.ending_at(step)
            other.recovery = None if self.recovery is None else self.recovery.ending_at(step)
        return self._endings[step]

    def solve(
        self, tick: int, state: np.ndarray, stance: np.ndarray, bounds: Mapping[str, np.ndarray],
        offset: np.ndarray | None = None, last: Plan | None = None, recovering: bool = False,
    ) -> Plan:  # fmt: skip
        """Plans from tick k.

        Args:
            tick: k.
            state: [c, v, p] per axis, shape (2, 3) [m, m/s, m].
            stance: centres of the last and of this step's box per axis, shape (2, 2) [m].
            bounds: V̄(k) … V̄(k + H) of each barrier, shape (H + 1,) [m/s].
            offset: expected real minus template ZMP at k + 1 … k + H per axis, shape (2, H) [m].
            last: the plan of the tick before, for warm start and fallback.
        """
        if recovering and self.recovery is not None:
            return self.recovery.solve(tick, state, stance, bounds, offset, last).of_disturbed(Reason.RECOVERING)
        phase = tick % self.gait.period
        same = last is not None and last.recovering == (self.config.stability == "paid")
        thetas: list[np.ndarray] = []
        results: list[QpResult] = []
        reasons: list[Reason] = []
        for axis in (0, 1):
            shift = None if offset is None else offset[axis]
            theta = self.theta(axis, tick, state[axis], stance[axis], bounds, shift, last)
            guess = last.active[axis] if last is not None and same else None
            result, why = self._solvers[axis][phase].solve(theta, guess), Reason.SOLVED
            if not result.ok:
                result, why = self._descend(axis, phase, theta, result)
            thetas.append(theta)
            results.append(result)
            reasons.append(why)
        reason = max(reasons)
        if reason == Reason.NO_STEADY_PLAN and self.recovery is not None:
            plan = self.recovery.solve(tick, state, stance, bounds, offset, last).of_disturbed(reason)
        elif not reason.planned:
            plan = self._fallback(tick, state, stance, last, reason)
        else:
            plan = self._plan(tick, results, reason)
        if reason <= Reason.CROSS_SOLVED:
            return plan
        return plan._replace(unmet=unmet(plan, [axis[phase] for axis in self.qps], thetas, reasons))

    def _plan(self, tick: int, results: Sequence[QpResult], reason: Reason) -> Plan:
        """What the solvers of both axes found."""
        horizon, n_f = self.config.horizon, self.footholds
        own = zip(results, self._slack_starts, strict=True)
        slacks = np.concatenate([slack_by_barrier(r.decisions[horizon + n_f :], starts) for r, starts in own])
        if reason == Reason.SOLVED and slacks.max(initial=0.0) > NOTICED:
            reason = Reason.SOFTENED
        plans = np.array([r.decisions[: horizon + n_f] for r in results])
        active = (self._padded(0, results[0].active), self._padded(1, results[1].active))
        cost = sum(r.cost for r in results)
        return Plan(tick, plans[:, :horizon], plans[:, horizon:], active, slacks, cost, reason, 0)

    def _padded(self, axis: int, active: np.ndarray) -> np.ndarray:
        """Flags for the longest program of this axis: rows that this phase, or a lower rung, lacks are inactive."""
        missing = self.rows[axis] - len(active)
        if missing < 0:  # the program of a lower rung, whose rows are others
            return np.zeros(self.rows[axis])
        return np.concatenate([active, np.zeros(missing)]) if missing else active

    def _descend(self, axis: int, phase: int, theta: np.ndarray, result: QpResult) -> tuple[QpResult, Reason]:
        """The first rung below the scenario's own problem that has a solution, and what to say of it."""
        for rung in self._rungs:
            if rung.reason == Reason.CROSS_SOLVED and result.infeasible:
                continue  # it has been proved that there is no solution
            if rung.reason == Reason.RELAXED and result.infeasible and self.recovery is not None:
                return result, Reason.NO_STEADY_PLAN  # rather than a steady walk that misses its tail
            result = rung.solver(axis, phase).solve(theta)
            if result.ok:
                return result, rung.reason
        return result, Reason.INFEASIBLE if result.infeasible else Reason.NOT_OPTIMAL

    def _fallback(self, tick: int, state: np.ndarray, stance: np.ndarray, last: Plan | None, reason: Reason) -> Plan:
        """The last plan shifted by a tick, its first input repeated at the end as in (32), its next ZMP in the box."""
        step = tick // self.gait.period
        ahead = self.preview.steps(step)
        targets = stance[:, 1:] + np.cumsum(ahead.moves, axis=1)
        if last is None:
            inputs, footholds, count = np.zeros((2, self.config.horizon)), targets, 1
            active = tuple(np.zeros(rows) for rows in self.rows)
        else:
            inputs, count, active = np.roll(last.inputs, -1, axis=1), last.fallbacks + 1, last.active
            footholds = last.footholds
            if step != last.tick // self.gait.period:
                footholds = np.hstack([footholds[:, 1:], footholds[:, -1:] + ahead.moves[:, -1:]])
        low, high = self.zmp_box(tick + 1, stance, footholds).T
        delta = self.gait.config.tick
        inputs[:, 0] = (np.clip(state[:, 2] + delta * inputs[:, 0], low, high) - state[:, 2]) / delta
        slacks = np.zeros(sum(map(len, self.barriers)))
        return Plan(tick, inputs, footholds, active, slacks, np.nan, reason, count)  # type: ignore[arg-type]

    def zmp_box(self, tick: int, stance: np.ndarray, footholds: np.ndarray) -> np.ndarray:
        """The box (27), without the margin, at a tick: x_min, x_max, then y, shape (2, 2) [m].

        Args:
            tick: when.
            stance: centres of the last and this step's box at the tick before, shape (2, 2) [m].
            footholds: centres of the coming ones, shape (2, n_f) [m].
        """
        before = self.gait.phase(tick - 1)[0]
        step, phase = self.gait.phase(tick)
        weight = self.gait.box_weight[phase]
        half = self.preview.steps(before).half
        box = np.empty((2, 2))
        _write_box(step - before, weight, stance, footholds, half, self.config.zmp_margin, box)
        return box


@compiled
def _write_box(
    place: int, weight: float, stance: np.ndarray, footholds: np.ndarray, half: np.ndarray, margin: float,
    box: np.ndarray,
) -> None:  # fmt: skip
    """The box on its way from the stance foot at `place` of [last, this, coming …] to the next one."""
    for axis in range(2):
        start = stance[axis, place]
        end = stance[axis, 1] if place == 0 else footholds[axis, 0]
        centre = (1.0 - weight) * start + weight * end
        side = (1.0 - weight) * half[axis, place] + weight * half[axis, place + 1] + margin
        box[axis, 0], box[axis, 1] = centre - side, centre + side
