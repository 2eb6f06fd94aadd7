"""Joint barriers: random postures under random commands, and one joint beside a clamp and a continuous-time barrier."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.robot import Biped, InverseDynamics, Side, WholeBodyIk
from pdhocbf_drake.simulation.granted import grip_of
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.limits.rows import BARRIERS
from pdhocbf_drake.studies.shared.checks import Outcome, least, most
from pdhocbf_drake.studies.shared.row_kinds import Asked
from pdhocbf_drake.studies.shared.work import Work
from pdhocbf_drake.whole_body.deviation import TASKS, Deviation
from pdhocbf_drake.whole_body.joint_barriers import JointBarriers
from pdhocbf_drake.whole_body.layer import Moving, WholeBody
from pdhocbf_drake.whole_body.memory import BodyMemory
from pdhocbf_drake.whole_body.reason import Reason

_POSTURES = 1000
_SHARES: dict[float, Side | None] = {0.0: "left", 0.5: None, 1.0: "right"}  # of the load; the foot in the air
_SIZES = (0.01, 0.1, 1.0)  # of motions and commands, from nearly at rest to violent
_TICKS = (0.01, 0.05, 0.1, 0.15)  # [s]
_RATE = 15.0  # α of both class-K functions in continuous time [1/s]
_ANGLE, _PUSH = 0.5, 40.0  # limit of the single joint and acceleration towards it [rad, rad/s²]


class Postures(NamedTuple):
    """What became of random postures: the farthest that a joint is beyond its limit [rad], and the reasons."""

    beyond: float
    reasons: list[Reason]


def random_postures(scenario: Scenario, count: int, seed: int = 0) -> Postures:
    """Joints with ψ_0, ψ_1 ≥ 0, often at an edge of that, a body of any motion and any command, for two ticks each."""
    biped, config, tick = Biped.load(scenario.robot), scenario.whole_body, scenario.tick
    ik, rng, beyond, reasons = WholeBodyIk(biped), np.random.default_rng(seed), -math.inf, list[Reason]()
    task, nowhere = ik.task_space, Deviation(np.zeros(TASKS), np.zeros(TASKS))
    keep, dynamics = WholeBody(biped, task, config, tick, grip_of(biped, scenario)), InverseDynamics(biped, task)
    lower, upper = biped.position_limits.T
    for _ in range(count):
        q, v = _random_state(biped, config.joint_gamma[0] / tick, rng)
        share, size = float(rng.choice(list(_SHARES))), float(rng.choice(_SIZES))
        v *= size
        task.set_state(q, v)
        vdot = task.solve(30.0 * size * rng.normal(size=TASKS) - task.bias())
        vdot = 100.0 * rng.normal(size=TASKS) if vdot is None else vdot
        torque = dynamics(q, v, vdot, share)
        kept = keep(Moving(q, v, vdot, torque, share, _SHARES[share], BodyMemory.start(torque.tau, 1), 0), nowhere)
        reasons.append(kept.reason)
        angle, rate = q[biped.q_index], v[biped.v_index]
        for _ in range(2):  # the second tick shows the acceleration
            angle, rate = angle + tick * rate, rate + tick * kept.vdot[biped.v_index]
            beyond = max(beyond, float(np.maximum(angle - upper, lower - angle).max()))
    return Postures(beyond, reasons)


def _random_state(biped: Biped, rate: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    lower, upper = biped.position_limits.T
    q, v = biped.bent_knee.copy(), rng.normal(size=TASKS)
    angles = lower + np.clip(rng.uniform(-0.3, 1.3, len(lower)), 0.0, 1.0) * (upper - lower)
    most = np.minimum(rate * (upper - angles), biped.velocity_limits)
    least_rate = np.maximum(rate * (lower - angles), -biped.velocity_limits)
    q[biped.q_index] = angles
    v[biped.v_index] = least_rate + np.clip(rng.uniform(-0.3, 1.3, len(lower)), 0.0, 1.0) * (most - least_rate)
    return q, v


class Stop(NamedTuple):
    """A joint that is pushed to its limit: how far it goes beyond [rad], and its largest acceleration [rad/s²]."""

    beyond: float
    acceleration: float


def stop(kind: str, tick: float) -> Stop:
    """One joint under a constant acceleration towards its limit, 3 s in ticks δ [s]: q⁺ = q + δ v, v⁺ = v + δ a.

    Args:
        kind: "barrier", ψ_2 ≥ 0; "continuous", ḧ + 2α ḣ + α² h ≥ 0 at the tick, held until the next one; or "clamp",
            the angle is clipped.
    """
    gamma = min(1.0 - math.exp(-_RATE * tick), 0.5)
    barriers = JointBarriers.of(np.array([-_ANGLE]), np.array([_ANGLE]), np.array([np.inf]), (gamma, gamma), tick)
    q = v = largest = farthest = 0.0
    for _ in range(round(3.0 / tick)):
        a = _PUSH
        if kind == "barrier":
            a = min(a, float(barriers.interval(np.array([q]), np.array([v]))[1][0]))
        elif kind == "continuous":
            a = min(a, _RATE * (_RATE * (_ANGLE - q) - 2.0 * v))
        q, before = q + tick * v, v
        v += tick * a
        if kind == "clamp" and q > _ANGLE:
            q, v = _ANGLE, 0.0
        farthest, largest = max(farthest, q - _ANGLE), max(largest, abs(v - before) / tick)
    return Stop(farthest, largest)


def plan(row: str, asked: Asked) -> list[Work]:
    """Random postures; where quick, a fifth of them."""
    return [Work(row, asked.scenario, {"count": _POSTURES // 5 if asked.quick else _POSTURES})]


def measure(work: Work) -> Outcome:
    """Random postures beside their limits, and a sentence for each tick of the single joint."""
    scenario, count = work.with_keys(), work.setting["count"]
    found = random_postures(scenario, count)
    counts = {reason.name: found.reasons.count(reason) for reason in Reason if reason in found.reasons}
    checks = [
        most(BARRIERS, "joint beyond its limit", found.beyond, 1e-6, "rad"),
        most(BARRIERS, "programs without an answer", counts.get(Reason.NOT_OPTIMAL.name, 0), 0.0),
        least(BARRIERS, "postures", len(found.reasons), float(count)),
    ]
    notes = [f"{BARRIERS}: of {count} postures " + ", ".join(f"{n} {name}" for name, n in counts.items())]
    for tick in _TICKS:
        own, other, clamp = (stop(kind, tick) for kind in ("barrier", "continuous", "clamp"))
        checks.append(most(BARRIERS, f"beyond in ticks of {tick:g} s", own.beyond, 1e-6, "rad"))
        notes.append(
            f"{BARRIERS}, ticks of {tick:g} s: {own.acceleration:.0f} rad/s² at most; a continuous-time barrier goes "
            f"{other.beyond:.2g} rad beyond, with {other.acceleration:.0f} rad/s²; a clamp stops with "
            f"{clamp.acceleration:.0f} rad/s²"
        )
    return Outcome(checks, notes)
