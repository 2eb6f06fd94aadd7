"""The pushes and the wind of a run, in words and as spans of time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.analysis.answers import Answer
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.scenario import Scenario

_NAMED = 3
_SMALL = 0.01  # share of an impulse below which a component is left out
_WORDS = (("forward", "backward"), ("left", "right"), ("up", "down"))
_AXES = (("in +x", "in -x"), ("in +y", "in -y"), ("in +z", "in -z"))

Span = tuple[float, float]


class Given(NamedTuple):
    """A push as the run had it.

    Attributes:
        span: its start and its end, or that of the run [s].
        impulse: F·(end − start), (3,), world axes [N s].
        body: the body that it acts on; None is the torso, or the template's mass.
    """

    span: Span
    impulse: NDArray[np.float64]
    body: str | None


def pushes_of(run: Run) -> list[Given]:
    """The pushes that act in the run, by their start."""
    scenario, log = run.scenario, run.log
    if scenario.system == "van_der_pol" or not len(log):
        return []
    found, ends = [], float(log.time[-1])
    for push in scenario.pushes:
        first, last = (tick * scenario.tick for tick in push.ticks(scenario.gait))
        end = min(last, ends)
        if first < end and any(push.force):
            body = push.body if scenario.system == "biped" else None
            found.append(Given((first, end), (end - first) * np.array(push.force), body))
    return sorted(found, key=lambda push: push.span)


def spans_of(run: Run) -> list[Span]:
    """Start and end of each push of the run [s]."""
    return [push.span for push in pushes_of(run)]


def push_rows(run: Run) -> list[tuple[str, str]]:
    """(subject, words) of the pushes, by impulse, direction and time, and of the wind; none for a run without."""
    rows, scenario = [], run.scenario
    pushes = pushes_of(run)
    if pushes:
        words = [_words(push, scenario) for push in pushes[:_NAMED]]
        more = f", and {len(pushes) - _NAMED} more" if len(pushes) > _NAMED else ""
        rows.append(("pushed", f"{'; '.join(words)}{more}"))
    if scenario.system != "van_der_pol" and any(scenario.wind):
        rows.append(("wind", _along(np.array([*scenario.wind, 0.0]), "N", scenario)))
    return rows


def push_answer(run: Run) -> Answer:
    """Whether the run was pushed, and how."""
    rows = [f"wind of {words}" if subject == "wind" else words for subject, words in push_rows(run)]
    return Answer("Was it pushed?", f"yes: {'; '.join(rows)}" if rows else "no")


def _words(push: Given, scenario: Scenario) -> str:
    body = "" if push.body is None else f" on {push.body}"
    return f"{_along(push.impulse, 'N s', scenario)}{body} at {round(push.span[0], 6):g} s"


def _along(vector: NDArray[np.float64], unit: str, scenario: Scenario) -> str:
    """A vector's size and direction, in words where the walk goes straight along x, otherwise by the world's axes."""
    straight = not (scenario.commands or scenario.path or scenario.start.yaw)
    size = float(np.linalg.norm(vector))
    parts = [
        (abs(value), ways[value < 0.0])
        for value, ways in zip(vector.tolist(), _WORDS if straight else _AXES, strict=True)
        if abs(value) > _SMALL * size
    ]
    if len(parts) == 1:
        return f"{size:.3g} {unit} {parts[0][1]}"
    return f"{size:.3g} {unit} ({', '.join(f'{value:.3g} {way}' for value, way in parts)})"
