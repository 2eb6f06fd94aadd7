"""A trial of certified sets: the MPC from random starts inside, and the rescue program from random starts outside."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.loop import walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.plan import Plan, Reason
from pdhocbf_drake.sets.polytope import Array
from pdhocbf_drake.studies.certify.psi_rows import zmp_of_psi
from pdhocbf_drake.studies.certify.rescue import SAVED, Rescue
from pdhocbf_drake.studies.certify.scenario_certificate import ScenarioCertificate
from pdhocbf_drake.studies.certify.starts import Start, inside_starts, outside_starts, zmp_range
from pdhocbf_drake.studies.certify.terminal import hard_rows, terminal_sets

TICKS = 400
Done = Callable[[int], None]


class Trial(NamedTuple):
    """The result of a trial.

    Attributes:
        inside: starts inside, drawn for both axes at a common phase.
        ticks: of closed loop from each of them.
        infeasible_ticks: ticks without a plan that meets the scenario's constraints, over all of them.
        h_min: least h on the way [m/s]; None without barriers.
        slack_max: largest slack of a barrier row on the way [m/s].
        outside: starts outside, along the main axis, that meet all limits now.
        unsavable: of these, how many the rescue program proves lost.
        excess_min: the least by which one of these must exceed a limit [m, m/s].
    """

    inside: int
    ticks: int
    infeasible_ticks: int
    h_min: float | None
    slack_max: float
    outside: int
    unsavable: int
    excess_min: float


def try_sets(found: ScenarioCertificate, count: int, seed: int = 0, report: Done = lambda done: None) -> Trial:
    """Tries sets from `count` starts inside and as many outside.

    Raises:
        InputError: a set is empty.
    """
    random = np.random.default_rng(seed)
    walk = found.walk
    mpc = PeriodicMpc(walk.gait, walk.vhip, found.scenario.mpc, walk.mpc.barriers, terminal_sets(found))
    infeasible, h_min, slack = 0, np.inf, 0.0
    for index in range(count):
        starts, zmps = _drawn(found, random)
        walked = walk_from(mpc, starts, zmps, TICKS)
        infeasible += walked.infeasible_ticks
        h_min, slack = min(h_min, walked.h_min), max(slack, walked.slack)
        report(index + 1)
    excesses = _outside(found, count, random, lambda index: report(count + index))
    return Trial(
        count, TICKS, infeasible, float(h_min) if np.isfinite(h_min) else None, slack,
        count, int(np.sum(excesses > SAVED)), float(excesses.min()),
    )  # fmt: skip


def _drawn(found: ScenarioCertificate, random: np.random.Generator) -> tuple[list[Start], list[float]]:
    """Starts of both axes at a common phase of the gait, and ZMPs that lead on into the sets."""
    long, zmp = _drawn_on(found, 1, random, None)
    short, first = _drawn_on(found, 0, random, long.phase % found.axes[0].template.period)
    return [short, long], [first, zmp]


def _drawn_on(
    found: ScenarioCertificate, axis: int, random: np.random.Generator, phase: int | None
) -> tuple[Start, float]:
    """A start on one axis and its ZMP; under a hard barrier from the set of its ψ rows, where ψ_1 gives the ZMP."""
    certificate = found.axes[axis]
    if found.scenario.mpc.barrier == "hard" and certificate.bounds:
        barrier, rows = hard_rows(certificate.bounds)
        start = inside_starts(rows, 1, random, phase)[0]
        zmp = zmp_of_psi(certificate.template, barrier, start.phase, start.state)
        without_psi: Array = np.delete(start.state, 2)
        return Start(start.phase, without_psi), zmp
    start = inside_starts(certificate.kept, 1, random, phase)[0]
    low, high = zmp_range(certificate.template, certificate.kept, start)
    return start, float(random.uniform(low, high))


def _outside(found: ScenarioCertificate, count: int, random: np.random.Generator, report: Done) -> np.ndarray:
    certificate = found.axes[found.main_axis]
    barriers = [bound.barrier for bound in certificate.bounds]
    limits = certificate.template.with_barriers(barriers)
    if isinstance(limits, int):
        raise InputError(f"no state meets the limits at phase {limits}")
    starts = sorted(outside_starts(limits, certificate.kept, count, random), key=lambda start: start.phase)
    excesses = np.empty(count)
    program, phase = None, -1
    for index, start in enumerate(starts):
        if program is None or start.phase != phase:
            phase = start.phase
            program = Rescue(certificate.template, barriers, found.reach, phase)
        excesses[index] = program.excess(start.state)
        report(index + 1)
    return excesses


# Plans that meet the scenario's constraints: with a soft barrier slacks are part of the problem.
_PLANNED = {"soft": (Reason.SOLVED, Reason.SOFTENED, Reason.CROSS_SOLVED), "hard": (Reason.SOLVED, Reason.CROSS_SOLVED)}
_SIDES = {1: 0, -1: 1}  # rows of Memory.feet


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


def walk_from(mpc: PeriodicMpc, starts: Sequence[Start], zmps: Sequence[float], ticks: int) -> Walked:
    """Walks the template under the MPC, without disturbances.

    Args:
        mpc: the controller.
        starts: for x and y, at the same phase of a gait; c and s as the stepping template has them.
        zmps: the ZMP at the start from the stance foot, for x and y [m].
        ticks: how long.
    """
    first, memory = _start(mpc, starts, zmps)
    infeasible, h_min, slack = 0, np.inf, 0.0
    for row in walk_template(mpc, memory, first, ticks):
        for state, group in zip(row.state, mpc.barriers, strict=True):
            h_min = min([h_min, *(float(barrier.h(row.tick, state)) for barrier in group)])
        infeasible += row.plan.reason not in _PLANNED[mpc.config.barrier]
        slack = max(slack, row.plan.slack)
        if not np.all(np.abs(row.memory.state - row.memory.stance[:, 1:] * [1.0, 0.0, 1.0]) < 1e2):
            infeasible += first + ticks - row.tick - 1  # fallen: no later tick counts as a walk
            break
    return Walked(infeasible, h_min, slack)


def _start(mpc: PeriodicMpc, starts: Sequence[Start], zmps: Sequence[float]) -> tuple[int, Memory]:
    """The tick and the controller's memory in the middle of a walk, at an even step or the one after it."""
    gait, n = mpc.gait, mpc.gait.period
    first = gait.config.start_steps + 2 + gait.config.start_steps % 2
    tick = first * n + max(start.phase for start in starts)
    step, phase = gait.phase(tick)
    here = mpc.commanded.steps(step).centre
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
        nothing = (np.zeros(mpc.rows[0]), np.zeros(mpc.rows[1]))
        inputs = np.zeros((2, mpc.config.horizon))
        memory.plan = Plan(tick - 1, inputs, footholds, nothing, np.zeros(0), np.nan, Reason.SOLVED, 0)
    return tick, memory
