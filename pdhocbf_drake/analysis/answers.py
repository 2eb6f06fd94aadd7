"""What a reader asks first of a run: did it walk, was it safe, did its barriers act, what gave way."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from pdhocbf_drake.analysis.metrics_schema import BarrierMetrics, Metrics
from pdhocbf_drake.analysis.summary import at_torque_limits, count, granted, judged_on, of, walked_piece
from pdhocbf_drake.simulation.run_log import FINISHED


class Answer(NamedTuple):
    """An answer in a few words.

    Attributes:
        question: what it answers.
        text: the answer, with numbers and units.
        good: whether it is what one hopes for; None where it is neither good nor bad.
    """

    question: str
    text: str
    good: bool | None = None


def answers(metrics: Metrics) -> list[Answer]:
    """The answers of a run, from its metrics alone."""
    return [_walked(metrics), _safe(metrics), Answer("Did a barrier act?", _acted(metrics)), _gave_way(metrics)]


def _walked(metrics: Metrics) -> Answer:
    walks = metrics.steps_taken is not None
    question = "Did it walk?" if walks else "Did it run to its end?"
    if metrics.ending != FINISHED:
        came = "".join(f", {walked_piece(piece)}" for piece in (metrics.ground or {}).values())
        return Answer(question, f"no: {metrics.ending} after {metrics.simulated_seconds:.2f} s{came}", False)
    if not walks:
        return Answer(question, f"yes, {metrics.simulated_seconds:.2f} s", True)
    steps, distance = count(metrics.steps_taken or 0, "step"), of(metrics.distance, "m")
    way = f"{steps}, {distance} of {of(metrics.distance_commanded, 'm')}"
    way += "".join(f", {walked_piece(piece)}" for piece in (metrics.ground or {}).values())
    if metrics.left_path:
        return Answer(question, f"it stayed up, but left its path: {way}", False)
    return Answer(question, f"yes: {way} in {metrics.simulated_seconds:.2f} s", True)


def _safe(metrics: Metrics) -> Answer:
    question = "Was it safe?"
    judged = {name: use for name, use in metrics.barriers.items() if use.violations is not None}
    if not judged:
        return Answer(question, "not judged: " + ("it ended too early" if metrics.barriers else "it has no barrier"))
    broken = {name: use for name, use in judged.items() if use.violations}
    least = [_least(name, use) for name, use in (broken or judged).items()]
    if not broken:
        return Answer(question, f"yes: {', '.join(least)}", True)
    below = ", ".join(f"{name} below 0 at {count(use.violations or 0, 'tick')}" for name, use in broken.items())
    return Answer(question, f"no: {below}; {', '.join(least)}", False)


def _least(name: str, use: BarrierMetrics) -> str:
    few = judged_on(use)
    return f"{name} h ≥ {of(use.h_min, use.unit)}" + (f" ({few})" if few else "")


def _acted(metrics: Metrics) -> str:
    if not metrics.barriers:
        return "it has none"
    return "; ".join(
        f"{name} never" if not use.active_ticks else f"{name} at {count(use.active_ticks, 'tick')}"
        for name, use in metrics.barriers.items()
    )


def _gave_way(metrics: Metrics) -> Answer:
    ways = list(_ways(metrics))
    return Answer("What gave way?", "; ".join(ways) or "nothing", not ways)


def _ways(metrics: Metrics) -> Iterator[str]:
    if metrics.mpc is not None and metrics.mpc.degraded:
        yield "degraded ticks: " + ", ".join(f"{number} {reason}" for reason, number in metrics.mpc.degraded.items())
    if metrics.torque_limit_hits:
        yield f"torques, {at_torque_limits(metrics)}"
    if metrics.joint_speed_margin_min is not None and metrics.joint_speed_margin_min < 0.0:
        yield f"a joint's speed by {of(-metrics.joint_speed_margin_min, 'rad/s')}"
    if metrics.commands_limited:
        yield f"{count(metrics.commands_limited, 'command')} granted in part{granted(metrics)}"
    if metrics.unloaded_ticks:
        yield f"no load on the ground at {count(metrics.unloaded_ticks, 'tick')}"
