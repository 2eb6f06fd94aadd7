"""The periodic MPC as a function: state and last plan in, new plan out. It never raises in the loop."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from pdhocbf_drake.mpc.believed import Believer
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.digest import digest
from pdhocbf_drake.mpc.fallback import shifted
from pdhocbf_drake.mpc.kernels import write_plan
from pdhocbf_drake.mpc.ladder import descended, rungs_of
from pdhocbf_drake.mpc.plan import NOTICED, Plan, Reason
from pdhocbf_drake.mpc.programs import ProgramCache
from pdhocbf_drake.mpc.recovery import recovery_of
from pdhocbf_drake.mpc.terminal_set import TerminalSet
from pdhocbf_drake.mpc.terms import TERMS
from pdhocbf_drake.mpc.terms.barrier import rows_of
from pdhocbf_drake.mpc.terms.term import Term
from pdhocbf_drake.mpc.walk_problem import Barriers, WalkProblem
from pdhocbf_drake.qp import ParametricQp, QpResult, QpSolver
from pdhocbf_drake.qp.solvers import solve_axes
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.barrier_changes import BarrierSettings
from pdhocbf_drake.walking.frame import rotation
from pdhocbf_drake.walking.vhip import Vhip

_NO_ROWS = np.zeros((0, 0))


class PeriodicMpc(WalkProblem):
    """Problem (36) for every phase of the step, compiled at start (that of a disturbed walk, when first needed).

    Attributes:
        believer: from measurements to the state to plan from, and from a plan to what is sent.
        qps, solvers: `qps[axis][k % len(qps[axis])]`, the compiled programs at tick k, and what solves them.
        rungs: what is solved where these have no solution, see `mpc.ladder`.
        recovery: the same for a disturbed walk, if the scenario has one.
        changing: the problem of each tick, of a walk whose barriers' γ is changed as it goes on; None elsewhere.
        settings: of such a walk's barriers.
        of_rises: the same problem of a walk that climbs evenly, by the rise of a step [m]; see `on`.

    Raises:
        InputError: the horizon is not a multiple of the gait (Lemma 2), or a barrier is of another kind.
    """

    recovery: PeriodicMpc | None

    def __init__(
        self,
        gait: Gait,
        vhip: Vhip,
        config: MpcConfig,
        barriers: Barriers,
        terminal: Mapping[int, TerminalSet] | None = None,
        cache: ProgramCache | None = None,
        on_demand: bool = False,
        turn: float = 0.0,
        kinds: Sequence[type[Term]] = TERMS,
    ) -> None:
        """Compiles every phase, except for what the cache has from other controllers.

        What a disturbed walk is planned with is compiled phase by phase when it is first needed, since most walks
        never need it: some 10 ms at each of the first N disturbed ticks. Where ticks must be on time, call `prepare`.

        Args:
            cache: what other controllers have compiled.
            on_demand: compile each phase when it is first needed.
            turn: angle by which the periodic tail is turned over a horizon; 0 is as commanded, see
                `terms.coupled_tail` [rad].
            kinds: the kinds of terms that make up the problem, in place of `terms.TERMS`.
        """
        super().__init__(gait, vhip, config, barriers, terminal, turn, kinds)
        cache, self.believer = cache or ProgramCache(), Believer(vhip, config)
        self._cache, self._rows_of_barriers = cache, dict[tuple[int, int], np.ndarray]()
        self._names = [digest(problem.key) for problem in self.problems]
        compiled = [cache.compiled(problem) for problem in self.problems]
        self.qps: list[Sequence[ParametricQp]] = [axis.qps for axis in compiled]
        self.solvers: list[Sequence[QpSolver]] = [axis.solvers for axis in compiled]
        if not on_demand:
            self.prepare()
        # A terminal set has more facets at some phases than at others; without one all phases have the same rows.
        self.rows = [axis.rows[0] if on_demand else max(axis.rows) for axis in compiled]
        self.rungs = rungs_of(self.problems, self.qps)
        self._slack_starts = [problem.slack_starts() for problem in self.problems]
        self._slacks = sum(map(len, self._slack_starts))
        if config.recovery is not None:
            self.recovery = PeriodicMpc(*recovery_of(gait, vhip, config), barriers, None, cache, True, turn, kinds)
            self.rows = [max(pair) for pair in zip(self.rows, self.recovery.rows, strict=True)]
            self.recovery.rows = self.rows
        self.changing: Callable[[int], PeriodicMpc] | None = None
        self.settings: BarrierSettings | None = None
        self.of_rises: Mapping[float, PeriodicMpc] = {}

    def prepare(self) -> None:
        """Compiles whatever is not compiled yet, the programs of a disturbed walk included."""
        self.solvers = [list(axis) for axis in self.solvers]
        for axis in (0, 1):
            for phase in range(len(self.solvers[axis]) if self.barriers[axis] else 0):
                self._barrier_rows(axis, phase)
        if self.recovery is not None:
            self.recovery.prepare()

    def in_force(self, tick: int) -> PeriodicMpc:
        """The problem of tick k: this one, unless it is `changing`."""
        return self if self.changing is None else self.changing(tick)

    def on(self, tick: int) -> PeriodicMpc:
        """This problem with the eta of the rise of the step of tick k, see `Gait.rise`.

        Over the whole horizon the rise is taken to go on: near the end of a staircase, and where there is none of that
        rise, eta is that of another ground.
        """
        if not self.of_rises:
            return self
        return self.of_rises.get(self.gait.rise(tick // self.gait.period), self)

    def solve(
        self, tick: int, state: np.ndarray, stance: np.ndarray, bounds: Mapping[str, np.ndarray],
        offset: np.ndarray | None = None, last: Plan | None = None, recovering: bool = False,
    ) -> Plan:  # fmt: skip
        """Plans from tick k, in the axes of the stance foot; all arguments and the plan are in those of the world.

        Args:
            tick: k.
            state: [c, v, p] per axis, shape (2, 3) [m, m/s, m].
            stance: centres of the last and of this step's box per axis, shape (2, 2) [m].
            bounds: V̄(k) … V̄(k + H) of each barrier, shape (H + 1,) [unit of h].
            offset: expected real minus template ZMP at k + 1 … k + H per axis, shape (2, H) [m].
            last: the plan of the tick before, for warm start and fallback.
            recovering: whether the walk is disturbed.

        Raises:
            ValueError: an array of another shape.
        """
        yaw = self.commanded.steps(tick // self.gait.period).yaw
        if not yaw:
            return self._solve(tick, state, stance, bounds, offset, last, recovering)
        seen, back = rotation(-yaw), rotation(yaw)
        offset, last = None if offset is None else seen @ offset, None if last is None else last.turned(seen)
        return self._solve(tick, seen @ state, seen @ stance, bounds, offset, last, recovering).turned(back)

    def _solve(
        self, tick: int, state: np.ndarray, stance: np.ndarray, bounds: Mapping[str, np.ndarray],
        offset: np.ndarray | None, last: Plan | None, recovering: bool = False,
    ) -> Plan:  # fmt: skip
        """`solve` in the axes of the stance foot."""
        if recovering and self.recovery is not None:
            return self.recovery._solve(tick, state, stance, bounds, offset, last).of_disturbed(Reason.RECOVERING)
        given = self.given(tick, state, stance, bounds, offset, last)
        same = last is not None and last.recovering == (self.config.stability == "paid")
        thetas = [problem.theta(given) for problem in self.problems]
        guesses = last.active if last is not None and same else (None, None)
        place = tick + self.gait.period * given.ahead.flipped  # of the programs, where steps of a gait differ
        results = solve_axes([axis[place % len(axis)] for axis in self.solvers], thetas, guesses)
        if results[0].ok and results[1].ok:
            return self._plan(tick, results, Reason.SOLVED, place)
        rungs = [self._descended(axis, place, thetas[axis], results[axis]) for axis in (0, 1)]
        results, reasons = (rungs[0][0], rungs[1][0]), [why for _, why in rungs]
        reason = max(reasons)
        if reason == Reason.NO_STEADY_PLAN and self.recovery is not None:
            plan = self.recovery._solve(tick, state, stance, bounds, offset, last).of_disturbed(reason)
        elif not reason.planned:
            plan = shifted(self, tick, state, stance, last, reason, self.rows)
        else:
            plan = self._plan(tick, results, reason, place)
        if reason <= Reason.CROSS_SOLVED:
            return plan
        return plan._replace(unmet=self._unmet(plan, thetas, reasons, place))

    def _plan(self, tick: int, results: Sequence[QpResult], reason: Reason, place: int) -> Plan:
        """What the solvers of both axes found for tick k, whose programs are those of the tick `place`."""
        (x, y), (starts_x, starts_y) = results, self._slack_starts
        inputs, footholds = np.empty((2, self.config.horizon)), np.empty((2, self.footholds))
        slacks, acting = np.empty(self._slacks), np.empty(self._slacks)
        largest = write_plan(
            x.decisions, y.decisions, starts_x, starts_y, self._barrier_rows(0, place), self._barrier_rows(1, place),
            x.active, y.active, NOTICED, inputs, footholds, slacks, acting,
        )  # fmt: skip
        if reason == Reason.SOLVED and largest > NOTICED:
            reason = Reason.SOFTENED
        active = (self._padded(0, x.active), self._padded(1, y.active))
        return Plan(
            tick, inputs, footholds, active, slacks, x.cost + y.cost, reason, 0, unmet=self.all_met, acting=acting
        )

    def _barrier_rows(self, axis: int, tick: int) -> np.ndarray:
        """1 where a row of an axis' program at tick k is one of a barrier, (n_b, m); (0, 0) without barriers."""
        if not self.barriers[axis]:
            return _NO_ROWS
        place = axis, tick % len(self.qps[axis])
        if place not in self._rows_of_barriers:

            def make() -> np.ndarray:
                names = np.array(self._qp(axis, tick).names)
                return np.array([names == rows_of(barrier.name) for barrier in self.barriers[axis]], dtype=float)

            name = self._names[axis]
            kept = make() if name is None else self._cache.array(f"barrier rows {name} {place[1]}", make)
            self._rows_of_barriers[place] = kept
        return self._rows_of_barriers[place]

    def _padded(self, axis: int, active: np.ndarray) -> np.ndarray:
        """Flags for the longest program of this axis: rows that this phase, or a lower rung, lacks are inactive."""
        missing = self.rows[axis] - len(active)
        if missing < 0:  # the program of a lower rung, whose rows are others
            return np.zeros(self.rows[axis])
        return np.concatenate([active, np.zeros(missing)]) if missing else active

    def _descended(self, axis: int, tick: int, theta: np.ndarray, result: QpResult) -> tuple[QpResult, Reason]:
        if result.ok:
            return result, Reason.SOLVED
        return descended(self.rungs, self.recovery is not None, axis, tick, theta, result)

    def _unmet(self, plan: Plan, thetas: Sequence[np.ndarray], reasons: Sequence[Reason], place: int) -> np.ndarray:
        """`Plan.unmet`: what each axis' own program demands and the plan misses, besides what it misses already."""
        unmet = plan.unmet.copy()
        for axis, why in enumerate(reasons):
            decisions = None
            if why in (Reason.RELAXED, Reason.NO_STEADY_PLAN):
                decisions = np.concatenate([plan.inputs[axis], plan.footholds[axis]])
            elif why != Reason.INFEASIBLE:
                continue
            missed = self.problems[axis].missed(self._qp(axis, place), thetas[axis], decisions)
            unmet[axis] = np.maximum(unmet[axis], missed)
        return unmet

    def _qp(self, axis: int, tick: int) -> ParametricQp:
        return self.qps[axis][tick % len(self.qps[axis])]
