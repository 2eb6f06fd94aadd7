"""The periodic MPC as a function: state and last plan in, new plan out. It never raises in the loop."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from copy import copy

import numpy as np

from pdhocbf_drake.barriers import AffineBarrier
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.kept import Kept
from pdhocbf_drake.mpc.axis_problem import AxisProblem
from pdhocbf_drake.mpc.believed import Believer
from pdhocbf_drake.mpc.commanded import CommandedSteps
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.digest import digest
from pdhocbf_drake.mpc.kernels import write_plan
from pdhocbf_drake.mpc.plan import NOTICED, Plan, Reason
from pdhocbf_drake.mpc.programs import ProgramCache, rungs_of
from pdhocbf_drake.mpc.recovery import recovery_of
from pdhocbf_drake.mpc.robust import zmp_margin
from pdhocbf_drake.mpc.terminal_set import TerminalSet
from pdhocbf_drake.mpc.terms import TERMS, constraints_of
from pdhocbf_drake.mpc.terms.barrier import rows_of
from pdhocbf_drake.mpc.terms.stability import Stability
from pdhocbf_drake.mpc.terms.term import Setting, Term, Tick
from pdhocbf_drake.qp import ParametricQp, QpResult, QpSolver
from pdhocbf_drake.qp.solvers import solve_axes
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.barrier_changes import BarrierSettings
from pdhocbf_drake.walking.bound_samples import bound_samples
from pdhocbf_drake.walking.commands import Command
from pdhocbf_drake.walking.course import Course
from pdhocbf_drake.walking.divergent import DivergentComponent
from pdhocbf_drake.walking.footsteps import Resumed
from pdhocbf_drake.walking.frame import rotation
from pdhocbf_drake.walking.vhip import Vhip
from pdhocbf_drake.walking.walk_barrier import WalkBarrier

_NO_ROWS = np.zeros((0, 0))
_COURSES = 4  # walks under commands of a port that are kept: one a step
Barriers = tuple[Sequence[AffineBarrier], Sequence[AffineBarrier]]


class PeriodicMpc:
    """Problem (36) for every phase of the step, compiled at start (that of a disturbed walk, when first needed).

    Attributes:
        gait, vhip, divergent: the walk, its template and the divergent component of that.
        barriers: the barriers of the axes x and y.
        terminal: the terminal sets (20f) of the axes, by axis; none where the tail is demanded instead.
        believer: from measurements to the state to plan from, and from a plan to what is sent.
        commanded: the steps that the gait commands.
        problems: problem (36) of both axes, which fill θ.
        qps, solvers: `qps[axis][k % len(qps[axis])]`, the compiled programs at tick k, and what solves them.
        rungs: what is solved where these have no solution, see `mpc.programs`.
        constraints: what a plan may miss on each axis, with its unit, in the order of `Plan.unmet`.
        recovery: the same for a disturbed walk, if the scenario has one.
        changing: the problem of each tick, of a walk whose barriers' γ is changed as it goes on; None elsewhere.
        settings: of such a walk's barriers.
        of_rises: the same problem of a walk that climbs evenly, by the rise of a step [m]; see `on`.

    Raises:
        InputError: the horizon is not a multiple of the gait (Lemma 2), or a barrier is of another kind.
    """

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
        cache = cache or ProgramCache()
        gait_ticks = gait.config.ticks_per_gait
        if config.horizon % gait_ticks:
            raise InputError(
                f"mpc.horizon: Lemma 2 needs a multiple of the gait's {gait_ticks} ticks (two steps), "
                f"such as {gait_ticks} or {2 * gait_ticks} (given: {config.horizon})"
            )
        self.gait, self.vhip, self.config, self.barriers = gait, vhip, config, barriers
        self.divergent, self.believer = DivergentComponent(vhip), Believer(vhip, config)
        self._omega: list[float] = self.divergent.omega.tolist()
        self.footholds = config.horizon // gait.period
        self.terminal = dict(terminal or {})
        self.constraints = constraints_of(config, kinds)
        self._turn, self._kinds = turn, kinds
        self._shapes = (2, 3), (2, 2), (2, config.horizon)
        self._all_met = np.zeros((2, len(self.constraints)))  # in every plan that misses nothing, never written into
        self._read(gait)
        self._cache, self._rows_of_barriers = cache, dict[tuple[int, int], np.ndarray]()
        self._names = [digest(problem.key) for problem in self.problems]
        compiled = [cache.compiled(problem) for problem in self.problems]
        self.qps: list[Sequence[ParametricQp]] = [axis.qps for axis in compiled]
        self.solvers: list[Sequence[QpSolver]] = [axis.solvers for axis in compiled]
        self.recovery: PeriodicMpc | None = None
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
        self._kept: dict[Hashable, PeriodicMpc] = {}
        self._courses = Kept[PeriodicMpc](_COURSES)
        self.of_rises: Mapping[float, PeriodicMpc] = {}

    def _read(self, gait: Gait) -> None:
        """Reads commanded steps from a gait, as the problems of both axes do."""
        config = self.config
        self.gait = gait
        self._margin = zmp_margin(self.vhip, config)
        self.commanded = CommandedSteps(gait, config.horizon, self._margin, config.plan_limits)
        if config.robust is not None and self.commanded.steps(gait.config.start_steps + 2).half.min() <= 0.0:
            raise InputError(f"mpc.robust: the ZMP may err by {self._margin:.3g} m, which leaves nothing of its box")
        self.problems = [AxisProblem(self._setting(axis), self._kinds) for axis in (0, 1)]
        barriers, count = (*self.barriers[0], *self.barriers[1]), config.horizon + 1
        self._bounds = {barrier.name: bound_samples(barrier, gait, count) for barrier in barriers}

    def _setting(self, axis: int) -> Setting:
        barriers, terminal = tuple(self.barriers[axis]), self.terminal.get(axis)
        return Setting(
            axis, self.gait, self.vhip, self.divergent, self.config, barriers, terminal, self.commanded, self._turn
        )

    def prepare(self) -> None:
        """Compiles whatever is not compiled yet, the programs of a disturbed walk included."""
        self.solvers = [list(axis) for axis in self.solvers]
        for axis in (0, 1):
            for phase in range(len(self.solvers[axis]) if self.barriers[axis] else 0):
                self._barrier_rows(axis, phase)
        if self.recovery is not None:
            self.recovery.prepare()

    def bounds(self, tick: int) -> dict[str, np.ndarray]:
        """V̄(k) … V̄(k + H) of each barrier by name, shape (H + 1,) [unit of h]."""
        return {name: samples(tick) for name, samples in self._bounds.items()}

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

    def expect(self, asked: Command, parts: int) -> None:
        """Makes some parts of what the bounds need of a command that is to be taken up, each in some 2 ms."""
        granted = self.gait.footsteps.granted(asked)
        for barrier in (*self.barriers[0], *self.barriers[1]):
            if granted.walks and isinstance(barrier, WalkBarrier) and barrier.orbits is not None:
                for _ in range(parts):
                    barrier.orbits.expect(granted)
                return  # all have the same orbits

    def following(self, course: Course | None) -> PeriodicMpc:
        """This problem for the walk as it goes on after the course of its present step, see `Gait.following`."""
        if course is None:
            return self
        return self._courses.get(course, lambda: self.walking(lambda gait: gait.following(course)))

    def ended_by(self, last_step: float) -> PeriodicMpc:
        """This problem, or where a last step has been set (not −1), that of the walk that ends there."""
        return self if last_step < 0 else self.ending_at(round(last_step))

    def ending_at(self, step: int) -> PeriodicMpc:
        """The same problem for a walk whose last swing is that of step j."""
        return self._derived(step, lambda gait: gait.ending_at(step))

    def resumed_by(self, resumed: Resumed) -> PeriodicMpc:
        """The same problem for a walk with steps in place of a stand."""
        if resumed == self.gait.footsteps.resumed:
            return self
        return self._derived(resumed, lambda gait: gait.resumed_by(resumed))

    def _derived(self, key: Hashable, change: Callable[[Gait], Gait]) -> PeriodicMpc:
        if key not in self._kept:
            self._kept[key] = self.walking(change)
        return self._kept[key]

    def walking(self, change: Callable[[Gait], Gait]) -> PeriodicMpc:
        """The same problem for a walk that is changed, with the same programs."""
        other = copy(self)
        other._kept, other._courses = {}, Kept(_COURSES)
        other._read(change(self.gait))
        other.recovery = None if self.recovery is None else self.recovery.walking(change)
        return other

    def given(
        self, tick: int, state: np.ndarray, stance: np.ndarray, bounds: Mapping[str, np.ndarray],
        offset: np.ndarray | None = None, last: Plan | None = None,
    ) -> Tick:  # fmt: skip
        """What θ of both axes is filled from; arguments as in `solve`, but in the axes of the stance foot."""
        shapes = state.shape, stance.shape, self._shapes[2] if offset is None else offset.shape
        if shapes != self._shapes:
            raise ValueError(f"state, stance and offset must have shapes {self._shapes}, given {shapes}")
        step, phase = self.gait.phase(tick)
        (x, vx, x_zmp), (y, vy, y_zmp) = state.tolist()
        omega = self._omega[phase]
        error = x + vx / omega - x_zmp, y + vy / omega - y_zmp
        ahead, here = self.commanded.steps(step), stance[:, 1].tolist()
        return Tick(tick, step, phase, state, stance, here, error, ahead, bounds, offset, last)

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
        rungs = [self._descend(axis, place, thetas[axis], results[axis]) for axis in (0, 1)]
        results, reasons = (rungs[0][0], rungs[1][0]), [why for _, why in rungs]
        reason = max(reasons)
        if reason == Reason.NO_STEADY_PLAN and self.recovery is not None:
            plan = self.recovery._solve(tick, state, stance, bounds, offset, last).of_disturbed(reason)
        elif not reason.planned:
            plan = self._fallback(tick, state, stance, last, reason)
        else:
            plan = self._plan(tick, results, reason, place)
        if reason <= Reason.CROSS_SOLVED:
            return plan
        return plan._replace(unmet=self._unmet(plan, thetas, reasons, place))

    def missed_tail(self, state: np.ndarray, plan: Plan) -> float:
        """By how much a plan from `state` misses its anticipative tail, in x or in y [m]; a step makes that good."""
        missed, yaw = 0.0, self.commanded.steps(plan.tick // self.gait.period).yaw
        if yaw:
            plan, state = plan.turned(rotation(-yaw)), rotation(-yaw) @ state
        for problem, inputs, axis_state in zip(self.problems, plan.inputs, state, strict=True):
            for term in problem.terms:
                if isinstance(term, Stability):
                    tail = term.anticipative_tail(plan.tick)
                    known = np.concatenate([inputs, axis_state, [tail]])
                    missed = max(missed, abs(float(term.row(plan.tick % self.gait.period) @ known)))
        return missed

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
        met = self._all_met
        return Plan(tick, inputs, footholds, active, slacks, x.cost + y.cost, reason, 0, unmet=met, acting=acting)

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

    def _descend(self, axis: int, tick: int, theta: np.ndarray, result: QpResult) -> tuple[QpResult, Reason]:
        """The first rung from the scenario's own problem down that has a solution, and the reason to log for it."""
        if result.ok:
            return result, Reason.SOLVED
        for rung in self.rungs:
            if rung.reason == Reason.CROSS_SOLVED and result.infeasible:
                continue  # it has been proved that there is no solution
            if rung.reason == Reason.RELAXED and result.infeasible and self.recovery is not None:
                return result, Reason.NO_STEADY_PLAN  # rather than a steady walk that misses its tail
            result = rung.solver(axis, tick).solve(theta)
            if result.ok:
                return result, rung.reason
        return result, Reason.INFEASIBLE if result.infeasible else Reason.NOT_OPTIMAL

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

    def _fallback(self, tick: int, state: np.ndarray, stance: np.ndarray, last: Plan | None, reason: Reason) -> Plan:
        """The last plan shifted by a tick, its first input repeated at the end as in (32), its next ZMP in the box."""
        step = tick // self.gait.period
        ahead = self.commanded.steps(step)
        targets = stance[:, 1:] + np.cumsum(ahead.moves, axis=1)
        if last is None:
            inputs, footholds, count = np.zeros((2, self.config.horizon)), targets, 1
            active = (np.zeros(self.rows[0]), np.zeros(self.rows[1]))
        else:
            inputs, count, active = np.roll(last.inputs, -1, axis=1), last.fallbacks + 1, last.active
            footholds = last.footholds
            if step != last.tick // self.gait.period:
                footholds = np.hstack([footholds[:, 1:], footholds[:, -1:] + ahead.moves[:, -1:]])
        low, high = self._box(tick + 1, stance, footholds).T
        delta = self.gait.config.tick
        inputs[:, 0] = (np.clip(state[:, 2] + delta * inputs[:, 0], low, high) - state[:, 2]) / delta
        slacks = np.zeros(sum(map(len, self.barriers)))
        met = self._all_met
        return Plan(tick, inputs, footholds, active, slacks, np.nan, reason, count, unmet=met, acting=slacks)

    def zmp_box(self, tick: int, stance: np.ndarray, footholds: np.ndarray) -> np.ndarray:
        """The box (27), without the margin, at a tick: x_min, x_max, then y, shape (2, 2) [m].

        Along the axes of the foot that stands at the tick before, from the world's origin.

        Args:
            tick: when.
            stance: centres of the last and this step's box at the tick before, in the world, shape (2, 2) [m].
            footholds: centres of the coming ones, shape (2, n_f) [m].
        """
        yaw = self.commanded.steps((tick - 1) // self.gait.period).yaw
        if yaw:
            stance, footholds = rotation(-yaw) @ stance, rotation(-yaw) @ footholds
        return self._box(tick, stance, footholds)

    def _box(self, tick: int, stance: np.ndarray, footholds: np.ndarray) -> np.ndarray:
        """`zmp_box` from centres along the axes of the stance foot."""
        step, phase = self.gait.phase(tick - 1)
        ahead = self.commanded.steps(step)
        box = self.gait.region.box(phase, stance, footholds, ahead.half, self._margin)
        if ahead.shift is not None:
            box += (self.gait.region.weights(phase, 1, self.footholds) @ ahead.shift.T).T
        return box
