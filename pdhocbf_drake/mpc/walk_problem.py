"""Problem (36) of a walk: what its gait commands, θ, the ZMP box, and the walks that derive from it."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from copy import copy
from typing import Any, TypeVar

import numpy as np

from pdhocbf_drake.barriers import AffineBarrier
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.kept import Kept
from pdhocbf_drake.mpc.axis_problem import AxisProblem
from pdhocbf_drake.mpc.commanded import Commanded, CommandedSteps
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.plan import Plan
from pdhocbf_drake.mpc.robust import zmp_margin
from pdhocbf_drake.mpc.terminal_set import TerminalSet
from pdhocbf_drake.mpc.terms import constraints_of
from pdhocbf_drake.mpc.terms.stability import Stability
from pdhocbf_drake.mpc.terms.term import Setting, Term, Tick
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.bound_samples import bound_samples
from pdhocbf_drake.walking.commands import Command
from pdhocbf_drake.walking.course import Course
from pdhocbf_drake.walking.divergent import DivergentComponent
from pdhocbf_drake.walking.footsteps import Resumed
from pdhocbf_drake.walking.frame import rotation
from pdhocbf_drake.walking.vhip import Vhip
from pdhocbf_drake.walking.walk_barrier import WalkBarrier

_COURSES = 4  # walks under commands of a port that are kept: one a step
Barriers = tuple[Sequence[AffineBarrier], Sequence[AffineBarrier]]
Own = TypeVar("Own", bound="WalkProblem")


class WalkProblem:
    """Problem (36) of both axes, not compiled.

    Attributes:
        gait, vhip, divergent: the walk, its template and the divergent component of that.
        config: of the MPC.
        barriers: the barriers of the axes x and y.
        terminal: the terminal sets (20f) of the axes, by axis; none where the tail is demanded instead.
        footholds: how many there are in a horizon.
        commanded: the steps that the gait commands.
        problems: problem (36) of both axes, which fill θ.
        constraints: what a plan may miss on each axis, with its unit, in the order of `Plan.unmet`.
        all_met: `Plan.unmet` of every plan that misses nothing; never written into.
        recovery: the same for a disturbed walk, if the scenario has one.

    Raises:
        InputError: the horizon is not a multiple of the gait (Lemma 2), or a barrier is of another kind.
    """

    def __init__(
        self,
        gait: Gait,
        vhip: Vhip,
        config: MpcConfig,
        barriers: Barriers,
        terminal: Mapping[int, TerminalSet] | None,
        turn: float,
        kinds: Sequence[type[Term]],
    ) -> None:
        """Arguments as those of `PeriodicMpc`."""
        gait_ticks = gait.config.ticks_per_gait
        if config.horizon % gait_ticks:
            raise InputError(
                f"mpc.horizon: Lemma 2 needs a multiple of the gait's {gait_ticks} ticks (two steps), "
                f"such as {gait_ticks} or {2 * gait_ticks} (given: {config.horizon})"
            )
        self.vhip, self.config, self.barriers = vhip, config, barriers
        self.divergent = DivergentComponent(vhip)
        self.footholds = config.horizon // gait.period
        self.terminal = dict(terminal or {})
        self._omega: list[float] = self.divergent.omega.tolist()
        self._turn, self._kinds = turn, kinds
        self.constraints = constraints_of(config, kinds)
        self.all_met = np.zeros((2, len(self.constraints)))
        self._shapes = (2, 3), (2, 2), (2, config.horizon)
        self.recovery: Any = None  # of the same class
        self._kept: dict[Hashable, Any] = {}
        self._courses = Kept[Any](_COURSES)
        self._read(gait)

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

    def bounds(self, tick: int) -> dict[str, np.ndarray]:
        """V̄(k) … V̄(k + H) of each barrier by name, shape (H + 1,) [unit of h]."""
        return {name: samples(tick) for name, samples in self._bounds.items()}

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

    def zmp_box(self, tick: int, stance: np.ndarray, footholds: np.ndarray) -> np.ndarray:
        """The box (27), without the margin, at a tick: x_min, x_max, then y, shape (2, 2) [m].

        Along the axes of the foot that stands at the tick before, from the world's origin.

        Args:
            tick: when.
            stance: centres of the last and this step's box at the tick before, in the world, shape (2, 2) [m].
            footholds: centres of the coming ones, shape (2, n_f) [m].
        """
        step, phase = self.gait.phase(tick - 1)
        ahead = self.commanded.steps(step)
        if ahead.yaw:
            seen = rotation(-ahead.yaw)
            stance, footholds = seen @ stance, seen @ footholds
        return self._box(phase, ahead, stance, footholds)

    def box(self, tick: int, stance: np.ndarray, footholds: np.ndarray) -> np.ndarray:
        """`zmp_box` from centres along the axes of the stance foot."""
        step, phase = self.gait.phase(tick - 1)
        return self._box(phase, self.commanded.steps(step), stance, footholds)

    def _box(self, phase: int, ahead: Commanded, stance: np.ndarray, footholds: np.ndarray) -> np.ndarray:
        box = self.gait.region.box(phase, stance, footholds, ahead.half, self._margin)
        if ahead.shift is not None:
            box += (self.gait.region.weights(phase, 1, self.footholds) @ ahead.shift.T).T
        return box

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

    def expect(self, asked: Command, parts: int) -> None:
        """Makes some parts of what the bounds need of a command that is to be taken up, each in some 2 ms."""
        granted = self.gait.footsteps.granted(asked)
        for barrier in (*self.barriers[0], *self.barriers[1]):
            if granted.walks and isinstance(barrier, WalkBarrier) and barrier.orbits is not None:
                for _ in range(parts):
                    barrier.orbits.expect(granted)
                return  # all have the same orbits

    def following(self: Own, course: Course | None) -> Own:
        """This problem for the walk as it goes on after the course of its present step, see `Gait.following`."""
        if course is None:
            return self
        return self._courses.get(course, lambda: self.walking(lambda gait: gait.following(course)))

    def ended_by(self: Own, last_step: float) -> Own:
        """This problem, or where a last step has been set (not −1), that of the walk that ends there."""
        return self if last_step < 0 else self.ending_at(round(last_step))

    def ending_at(self: Own, step: int) -> Own:
        """The same problem for a walk whose last swing is that of step j."""
        return self._derived(step, lambda gait: gait.ending_at(step))

    def resumed_by(self: Own, resumed: Resumed) -> Own:
        """The same problem for a walk with steps in place of a stand."""
        if resumed == self.gait.footsteps.resumed:
            return self
        return self._derived(resumed, lambda gait: gait.resumed_by(resumed))

    def _derived(self: Own, key: Hashable, change: Callable[[Gait], Gait]) -> Own:
        if key not in self._kept:
            self._kept[key] = self.walking(change)
        return self._kept[key]

    def walking(self: Own, change: Callable[[Gait], Gait]) -> Own:
        """The same problem for a walk that is changed, with the same programs."""
        other = copy(self)
        other._kept, other._courses = {}, Kept(_COURSES)
        other._read(change(self.gait))
        other.recovery = None if self.recovery is None else self.recovery.walking(change)
        return other
