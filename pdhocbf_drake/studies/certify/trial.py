"""A trial of certified sets: the MPC from random starts inside, and the rescue program from random starts outside."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.loop import walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.plan import Plan, Reason
from pdhocbf_drake.sets.polytope import Array
from pdhocbf_drake.studies.certify.adversary import KINDS, Adversary, Kind, adversary
from pdhocbf_drake.studies.certify.psi_rows import zmp_of_psi
from pdhocbf_drake.studies.certify.rescue import SAVED, Rescue
from pdhocbf_drake.studies.certify.scenario_certificate import ScenarioCertificate
from pdhocbf_drake.studies.certify.starts import Start, inside_starts, outside_starts, zmp_range
from pdhocbf_drake.studies.certify.terminal import hard_rows, terminal_sets
from pdhocbf_drake.walking.walk_barrier import WalkBarrier

TICKS = 400
Done = Callable[[int], None]


class Trial(NamedTuple):
    """The result of a trial.

    Attributes:
        inside: starts inside, drawn for both axes at a common phase; those of sets that withstand a disturbance are
            disturbed by random, constant and worst ones in turn.
        ticks: length of the walk from each of them.
        infeasible_ticks: ticks of these walks without a plan that meets the scenario's constraints.
        h_min: least h of these walks [m/s]; None without barriers.
        slack_max: largest slack of a barrier row in these walks [m/s].
        outside: starts outside, along the main axis, that meet all limits at first.
        unsavable: number of these that the rescue program proves lost.
        excess_min: their least excess over a limit, whatever is done; None without such starts [m or m/s].
    """

    inside: int
    ticks: int
    infeasible_ticks: int
    h_min: float | None
    slack_max: float
    outside: int
    unsavable: int
    excess_min: float | None


def try_sets(
    found: ScenarioCertificate, count: int, seed: int = 0, report: Done = lambda done: None, ticks: int = TICKS
) -> Trial:
    """Tries sets from `count` starts inside and as many outside; raises `InputError` if a set is empty.

    Under a disturbance only those inside are tried, since the program that proves others lost counts on none.
    """
    random = np.random.default_rng(seed)
    walk = found.walk
    mpc = PeriodicMpc(walk.gait, walk.vhip, walk.mpc.config, walk.mpc.barriers, terminal_sets(found))
    infeasible, h_min, slack = 0, np.inf, 0.0
    for index in range(count):
        in_y, zmp_y = _drawn(found, 1, random, None)  # y has the longer period
        in_x, zmp_x = _drawn(found, 0, random, in_y.phase % found.axes[0].template.period)
        walked = walk_from(mpc, [in_x, in_y], [zmp_x, zmp_y], ticks, _adversary(found, KINDS[index % 3], random))
        infeasible += walked.infeasible_ticks
        h_min, slack = min(h_min, walked.h_min), max(slack, walked.slack)
        report(index + 1)
    least_h = float(h_min) if np.isfinite(h_min) else None
    if found.axes[0].disturbance is not None:
        return Trial(count, ticks, infeasible, least_h, slack, 0, 0, None)
    excesses = _excesses(found, count, random, lambda index: report(count + index))
    lost = sum(excess > SAVED for excess in excesses)
    return Trial(count, ticks, infeasible, least_h, slack, count, lost, min(excesses))


def _drawn(
    found: ScenarioCertificate, axis: int, random: np.random.Generator, phase: int | None
) -> tuple[Start, float]:
    """A start on one axis and a ZMP that leads on into the set.

    Under a hard barrier the start is from the set of its ψ rows, and its ψ_1 determines the ZMP.
    """
    certificate = found.axes[axis]
    if found.scenario.mpc.barrier == "hard" and certificate.bounds:
        barrier, rows = hard_rows(certificate.bounds)
        start = inside_starts(rows, 1, random, phase)[0]
        zmp = zmp_of_psi(certificate.template, barrier, start.phase, start.state)
        return Start(start.phase, np.delete(start.state, 2)), zmp
    start = inside_starts(certificate.kept, 1, random, phase)[0]
    low, high = zmp_range(certificate.template, certificate.kept, start, certificate.disturbance)
    return start, float(random.uniform(low, high))


def _adversary(found: ScenarioCertificate, kind: Kind, random: np.random.Generator) -> Adversary | None:
    given = [c.disturbance for c in found.axes if c.disturbance is not None]
    if not given:
        return None
    return adversary(kind, given, [c.template for c in found.axes], [c.kept for c in found.axes], random)


def _excesses(found: ScenarioCertificate, count: int, random: np.random.Generator, report: Done) -> list[float]:
    """The least excess over a limit of each of `count` starts outside, by the rescue program [m or m/s]."""
    certificate = found.axes[found.main_axis]
    barriers = [bound.barrier for bound in certificate.bounds]
    starts = outside_starts(certificate.template.with_barriers(barriers), certificate.kept, count, random)
    excesses: list[float] = []
    for phase, group in groupby(sorted(starts, key=lambda start: start.phase), lambda start: start.phase):
        program = Rescue(certificate.template, [*barriers, *certificate.input_limits], found.reach, phase)
        for start in group:
            excesses.append(float(program.excess(start.state)))
            report(len(excesses))
    return excesses


# Reasons of plans that meet the scenario's constraints; under a soft barrier slacks are part of the problem.
_PLANNED = {"soft": (Reason.SOLVED, Reason.SOFTENED, Reason.CROSS_SOLVED), "hard": (Reason.SOLVED, Reason.CROSS_SOLVED)}
_SIDES = {1: 0, -1: 1}  # rows of Memory.feet
_FALLEN = 100.0  # c and p from the stance foot or v beyond this: the walk has fallen [m, m/s]


class Walked(NamedTuple):
    """A walk from one start.

    Attributes:
        infeasible_ticks: ticks without a plan that meets the scenario's constraints.
        h_min: least h of any barrier; inf without barriers [m/s].
        slack: largest slack of any barrier row [m/s].
    """

    infeasible_ticks: int
    h_min: float
    slack: float


def walk_from(
    mpc: PeriodicMpc,
    starts: Sequence[Start],
    zmps: Sequence[float],
    ticks: int,
    disturbance: Adversary | None = None,
) -> Walked:
    """Walks the template under the MPC.

    Args:
        mpc: the controller.
        starts: for x and y, at the same phase of a gait; c and s in the coordinates of the stepping template.
        zmps: the ZMP at the start from the stance foot, for x and y [m].
        ticks: length of the walk.
        disturbance: what disturbs it at every tick, if anything does.
    """
    first, memory = _start(mpc, starts, zmps)
    infeasible, h_min, slack = 0, np.inf, 0.0
    for row in walk_template(mpc, memory, first, ticks, disturbance=disturbance):
        for state, foot, group in zip(row.state, row.before.stance[:, 1], mpc.barriers, strict=True):
            for barrier in group:
                seen = barrier.seen(state, foot) if isinstance(barrier, WalkBarrier) else state
                h_min = min(h_min, float(barrier.h(row.tick, seen)))
        infeasible += row.plan.reason not in _PLANNED[mpc.config.barrier]
        slack = max(slack, row.plan.slack)
        if not np.all(np.abs(row.memory.state - row.memory.stance[:, 1:] * [1.0, 0.0, 1.0]) < _FALLEN):
            infeasible += first + ticks - row.tick - 1  # all later ticks count as infeasible
            break
    return Walked(infeasible, h_min, slack)


def _start(mpc: PeriodicMpc, starts: Sequence[Start], zmps: Sequence[float]) -> tuple[int, Memory]:
    """The tick and the controller's memory in the middle of a walk, at an even step or the one after it."""
    gait, n = mpc.gait, mpc.gait.period
    first = gait.config.start_steps + 2 + gait.config.start_steps % 2
    tick = first * n + max(start.phase for start in starts)
    step, phase = gait.phase(tick)
    here = np.array(mpc.commanded.steps(step).centre)
    commanded = mpc.commanded.steps(step - 1).moves[:, 0]
    coming = n - phase <= mpc.config.freeze_ticks
    chosen = np.array([start.state[2] if len(start.state) == 3 else np.nan for start in starts])
    last = np.where(coming | np.isnan(chosen), commanded, chosen)
    stance = np.stack([here - last, here], axis=1)
    feet = np.empty((2, 2))
    feet[_SIDES[gait.support(step)]], feet[_SIDES[-gait.support(step)]] = stance[:, 1], stance[:, 0]
    state: Array = np.array([
        [start.state[0] + foot, start.state[1], zmp + foot] for start, zmp, foot in zip(starts, zmps, here, strict=True)
    ])  # fmt: skip
    memory = Memory.at_start(mpc, state, feet)
    memory.stance = stance
    if coming:
        moves = mpc.commanded.steps(step).moves.copy()
        moves[:, 0] = np.where(np.isnan(chosen), moves[:, 0], chosen)
        footholds = here[:, None] + np.cumsum(moves, axis=1)
        active = (np.zeros(mpc.rows[0]), np.zeros(mpc.rows[1]))
        inputs = np.zeros((2, mpc.config.horizon))
        memory.plan = Plan(tick - 1, inputs, footholds, active, np.zeros(0), np.nan, Reason.SOLVED, 0)
    return tick, memory
