"""What the controller carries from tick to tick; `mpc.memory_layout` lays it out in one vector."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from pdhocbf_drake.mpc.believed import Beliefs
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.plan import Plan, Reason
from pdhocbf_drake.mpc.recovery import CALM, Disturbance, divergent_error
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.commands import STOP, Command, read_late
from pdhocbf_drake.walking.course import Course
from pdhocbf_drake.walking.footsteps import AS_COMMANDED, Resumed
from pdhocbf_drake.walking.frame import rotation, turned
from pdhocbf_drake.walking.kernels import write_foot_plan
from pdhocbf_drake.walking.sides import BOTH, LEFT

_ROWS = {LEFT: 0, -LEFT: 1}  # of `Memory.feet`, by the foot
UNCOMMANDED = (math.nan,) * 4


@dataclass
class Memory:
    """The controller's state after the update at tick k: outputs for tick k + 1, then what the next solve needs.

    Its arrays are never written into: whoever changes a part puts a new array in its place.

    Attributes:
        com_reference: x, ẋ, ẍ, y, ẏ, ÿ planned for k + 1 [m, m/s, m/s²].
        zmp_reference: x_zmp planned for k + 1 and its velocity up to then, likewise y [m, m/s].
        zmp_box: the box (27) at k + 1: x_min, x_max, y_min, y_max, along the heading of the stance foot at k [m].
        stance_plan: box centres of the last, this and the next two steps, counted from tick k + 1 [m].
        foot_plan: where the left foot starts and ends this step, then the right one: x, y each [m].
        solver_status: solved, wall time [s], cost, slack [m/s], fallbacks in a row, reason.
        barrier_slack: each barrier's largest slack, those of x, then those of y, shape (n_b,) [m/s].
        barrier_active: 1 for each barrier with an active row, in the same order, shape (n_b,).
        unmet: as `Plan.unmet`, x then y, shape (2 n_c,) [m].
        state: predicted [c, v, p] at k + 1 per axis, shape (2, 3).
        feet: last contact positions of the left and right foot, shape (2, 2) [m].
        stance: box centres of the last and this step per axis, shape (2, 2) [m].
        last_step: the step with the last swing, once the walk is to come to a stand; else −1.
        resumed: the steps that are taken in place of a stand.
        course: how far the walk has come under commands that it is given as it walks; None without.
        command: of those the last one, forward and lateral velocity, turn rate, and 1 for a stop
            [m/s, rad/s]; NaN before the first one.
        degraded: ticks in a row that had no solution or no measurement.
        measured: c and v of both axes as measured at k [m, m/s].
        plan: the plan made at k, or None at the start.
        disturbance: whether the walk is disturbed, and since when it has been quiet.
        beliefs: what lies between measurements and plans.
    """

    com_reference: np.ndarray
    zmp_reference: np.ndarray
    zmp_box: np.ndarray
    stance_plan: np.ndarray
    foot_plan: np.ndarray
    solver_status: np.ndarray
    barrier_slack: np.ndarray
    barrier_active: np.ndarray
    unmet: np.ndarray
    state: np.ndarray
    feet: np.ndarray
    stance: np.ndarray
    last_step: float
    degraded: float
    measured: np.ndarray
    plan: Plan | None
    disturbance: Disturbance = CALM
    resumed: Resumed = AS_COMMANDED
    course: Course | None = None
    command: tuple[float, ...] = UNCOMMANDED
    beliefs: Beliefs = field(default_factory=lambda: Beliefs.at_start(0))

    @classmethod
    def at_start(cls, mpc: PeriodicMpc, state: np.ndarray, feet: np.ndarray) -> Memory:
        """Standing (or walking) at tick 0 in `state`, both feet where they are given."""
        gait = mpc.gait
        centre = _centre(gait.support(0), feet)
        stance = _stances(centre, centre)
        eta = mpc.vhip.eta[0]
        com = np.array([[c, v, eta * (c - p)] for c, v, p in state]).ravel()
        zmp = np.array([[p, 0.0] for p in state[:, 2]]).ravel()
        inactive = np.zeros(sum(map(len, mpc.barriers)))
        memory = cls(
            com, zmp, np.zeros(4), np.zeros(8), np.zeros(8), np.array([1.0, 0, 0, 0, 0, Reason.SOLVED]),
            inactive, inactive, np.zeros(2 * len(mpc.constraints)), np.array(state, dtype=float),
            np.array(feet, dtype=float), stance, -1.0, 0.0, np.full(4, np.nan), None,
            beliefs=Beliefs.at_start(mpc.config.delay_ticks),
        )  # fmt: skip
        footholds = stance[:, 1:] + np.cumsum(mpc.commanded.steps(0).ways, axis=1)
        memory._write_feet(gait, 0, footholds)
        memory.zmp_box = mpc.zmp_box(1, stance, footholds).ravel()
        return memory

    @classmethod
    def standing(cls, mpc: PeriodicMpc) -> Memory:
        """At rest at tick 0, the CoM and ZMP in the middle of feet that stand `gait.stance_width` apart."""
        state = np.zeros((2, 3))
        state[:, [0, 2]] = mpc.gait.foothold(-1)[:, None]
        return cls.at_start(mpc, state, mpc.gait.feet_at_start)

    def copy(self) -> Memory:
        """Another memory with the same arrays."""
        other = Memory.__new__(Memory)
        other.__dict__.update(self.__dict__)
        return other

    def land(self, mpc: PeriodicMpc, tick: int, measured: np.ndarray) -> None:
        """Puts the foot that came down at the first tick of a step where it is measured; NaN leaves it.

        A measurement that is d ticks late shows that foot on the ground at tick d of the step.
        """
        step, phase = mpc.gait.phase(tick)
        if phase != mpc.config.delay_ticks or step == 0:
            return
        before = mpc.gait.support(step - 1)
        if before == BOTH or not np.isfinite(measured[:, :2]).all():
            return
        landed = _ROWS[-before]
        self.feet = self.feet.copy()
        self.feet[landed] = measured[landed, :2]
        self.stance = _stances(self.stance[:, 0], _centre(mpc.gait.support(step), self.feet))

    def replan(self, mpc: PeriodicMpc, tick: int, measured: np.ndarray | None) -> bool:
        """Lets a disturbed walk at commanded velocities go on from where it stands, at the tick at which a foot lands.

        Its path begins anew at the stance, with the heading of the sole that came down: a robot that was pushed aside,
        and slipped about the vertical, need not go back to a path that turns away from it meanwhile.

        Args:
            measured: centres and headings of the left and right sole, shape (2, 3) [m, rad]; None where they are
                as planned.

        Returns:
            Whether it did.
        """
        if not (self.disturbance.active and mpc.gait.turns):
            return False
        step, phase = mpc.gait.phase(tick)
        before = mpc.gait.support(step - 1)
        if phase != mpc.config.delay_ticks or before == BOTH:
            return False
        yaw = math.nan if measured is None else float(measured[_ROWS[-before], 2])
        x, y = self.stance[:, 1].tolist()
        course = mpc.gait.footsteps.replanned(step, (x, y), yaw)
        self.course = course or self.course
        return course is not None

    def notice(self, mpc: PeriodicMpc, tick: int, state: np.ndarray) -> None:
        """Compares the state believed at tick k with the one that was predicted for it, see `Disturbance`."""
        config = mpc.config.recovery
        if config is None:
            return
        error = divergent_error(mpc.divergent, tick, state, self.state)
        if mpc.gait.turns:
            step, phase = mpc.gait.phase(tick)
            yaw = mpc.gait.step(step).yaw
            error = turned(error, -yaw)
            if phase == 0:  # what was added up so far was seen from the last stance foot
                kept = turned(self.disturbance.error_sum, mpc.gait.step(step - 1).yaw - yaw)
                self.disturbance = self.disturbance._replace(error_sum=kept)
        self.disturbance = self.disturbance.after(config, mpc.gait.period, error)

    def hold(self, mpc: PeriodicMpc, tick: int) -> bool:
        """Lets a disturbed walk keep its heading, from this step on or, late in it, from the next one on.

        What it has of speed ahead would be speed aside for a foot that lands turned.

        Returns:
            Whether that changes the walk.
        """
        if not (self.disturbance.active and mpc.gait.turns):
            return False
        step, phase = mpc.gait.phase(tick)
        course = mpc.gait.footsteps.holding(step) if 2 * phase <= mpc.gait.period else None
        self.course = course or self.course
        return course is not None

    def moved(self, mpc: PeriodicMpc, plan: Plan) -> float:
        """How far the next foothold of a plan made at this tick is from the commanded one, ahead or aside [m]."""
        commanded = mpc.commanded.steps(plan.tick // mpc.gait.period)
        move = plan.footholds[:, 0] - self.stance[:, 1]
        if commanded.yaw:
            move = rotation(-commanded.yaw) @ move
        return float(np.abs(move - commanded.moves[:, 0]).max())

    def resume(self, mpc: PeriodicMpc, tick: int, resumed: Resumed) -> PeriodicMpc:
        """Takes steps in place of a stand; returns the problem of that walk, which begins like the last plan's."""
        other = mpc.resumed_by(resumed)
        self.resumed = resumed
        step = tick // mpc.gait.period
        here, coming = other.gait.support(step), other.gait.support(step + 1)
        if here != mpc.gait.support(step):  # a foot lifts off that stood
            self.stance = _stances(self.stance[:, 1], _centre(here, self.feet))
        moves = np.cumsum(other.commanded.steps(step).ways, axis=1)
        if self.plan is not None:
            footholds = self.stance[:, 1:] + moves
            if here == mpc.gait.support(step) and self.plan.tick // mpc.gait.period == step:
                first = self.plan.footholds[:, 0]
                if coming != mpc.gait.support(step + 1):
                    first = _landing(mpc.gait.support(step + 1), self.stance[:, 1], first)
                footholds += (first - footholds[:, 0])[:, None]
            self.plan = self.plan._replace(footholds=footholds)
        return other

    def problem(self, mpc: PeriodicMpc) -> PeriodicMpc:
        """The compiled problem `mpc` for the walk as it goes on from here."""
        # Asked several times a tick, of a walk that goes on as it was commanded.
        if self.course is None and self.last_step < 0 and self.resumed == mpc.gait.footsteps.resumed:
            return mpc
        return mpc.following(self.course).ended_by(self.last_step).resumed_by(self.resumed)

    def read(self, mpc: PeriodicMpc, tick: int, command: np.ndarray) -> None:
        """Reads a command that is given at tick k, unless it comes too late in a step, see `read_late`."""
        if command[3] > 0.5 or not read_late(mpc.gait.phase(tick)[1], mpc.gait.period):
            self.command = tuple(command.tolist())

    def take_up(self, mpc: PeriodicMpc, tick: int) -> None:
        """Takes up the command that was read last, if a step begins after tick k; before, makes parts of its bounds.

        Without one the walk goes on as its scenario commands; where it steps in place of a stand, that depends on which
        foot stands, and where it is disturbed it keeps its heading, so that it has a course, too.
        """
        if not mpc.gait.turns:
            return
        step, phase = mpc.gait.phase(tick + 1)
        if 0 < 2 * phase <= mpc.gait.period:
            return
        forward, lateral, turn, stop = self.command
        given = not math.isnan(forward)
        asked = None if not given else STOP if stop > 0.5 else Command(forward, lateral, turn)
        if asked is not None:
            mpc.expect(asked, 2 if phase == 0 or read_late(phase, mpc.gait.period) else 1)
        held = self.disturbance.active
        if phase or (not (given or held) and self.course is None and step > self.resumed.last):
            return
        self.course = mpc.gait.footsteps.course_after(step - 1, asked, held)

    def advance(self, mpc: PeriodicMpc, state: np.ndarray, plan: Plan, following: PeriodicMpc) -> None:
        """Steps the template by the plan's first input and moves on to tick k + 1.

        Args:
            mpc: the problem that the plan solves.
            state: c, v, p of both axes at tick k, shape (2, 3).
            plan: that of tick k.
            following: the problem at tick k + 1.
        """
        gait, tick = mpc.gait, plan.tick
        self.plan = plan
        self.state, references = mpc.vhip.references(tick, state, plan.inputs[:, 0])
        self.com_reference, self.zmp_reference = references[:6], references[6:]
        footholds = plan.footholds
        boxes = mpc.recovery if plan.recovering and mpc.recovery is not None else mpc
        self.zmp_box = boxes.zmp_box(tick + 1, self.stance, footholds).ravel()
        mpc, gait = following, following.gait
        step, phase = gait.phase(tick + 1)
        if phase == 0:
            support = gait.support(step - 1)
            if support != BOTH:
                self.feet = self.feet.copy()
                self.feet[_ROWS[-support]] = _landing(gait.support(step), self.stance[:, 1], footholds[:, 0])
            self.stance = _stances(self.stance[:, 1], _centre(gait.support(step), self.feet))
            moves = mpc.commanded.steps(step).ways
            footholds = np.hstack([footholds[:, 1:], footholds[:, -1:] + moves[:, -1:]])
        self._write_feet(gait, step, footholds)

    def _write_feet(self, gait: Gait, step: int, footholds: np.ndarray) -> None:
        """`stance_plan` and `foot_plan`: where the feet are and where they go."""
        planned = np.empty(16)
        support = gait.support(step)
        swinging = -1 if support == BOTH else _ROWS[-support]
        write_foot_plan(swinging, gait.support(step + 1) == BOTH, self.stance, footholds, self.feet, planned)
        self.stance_plan, self.foot_plan = planned[:8], planned[8:]


def _centre(support: int, feet: np.ndarray) -> np.ndarray:
    return feet.mean(axis=0) if support == BOTH else feet[_ROWS[support]]


def _stances(last: np.ndarray, this: np.ndarray) -> np.ndarray:
    """Two centres (2,) as columns (2, 2); `np.stack` takes longer than what it does."""
    stances = np.empty((2, 2))
    stances[:, 0], stances[:, 1] = last, this
    return stances


def _landing(following: int, stance: np.ndarray, foothold: np.ndarray) -> np.ndarray:
    """Where the swing foot lands: on the next stance, or, before a stand, so that both feet frame its centre."""
    return 2.0 * foothold - stance if following == BOTH else foothold
