"""What has been made to fit a robot, in sentences."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import groupby
from typing import Any

from pdhocbf_drake.fitting.defaults import Fitted


def sentences(fitted: Fitted, robot: str, every: bool) -> Iterator[str]:
    """The robot with how many values fit it, and why the step is another.

    Args:
        every: also a line for each part of the scenario with the values, the packaged robot's in brackets.
    """
    facts = fitted.facts
    sole = " x ".join(f"{2.0 * half:.3g}" for half in facts.sole)
    head = f"{len(fitted.changed)} values fit {robot} (legs {facts.leg:.3g} m, {facts.mass:.3g} kg, soles {sole} m)"
    if every:
        yield f"{head}; the packaged robot's in brackets:"
        parts = groupby(sorted(fitted.changed.items()), key=lambda change: change[0].partition(".")[0])
        for part, changes in parts:
            values = [f"{key.removeprefix(f'{part}.')} {_shown(new)} ({_shown(old)})" for key, (old, new) in changes]
            yield f"  {part}: {', '.join(values)}"
    else:
        yield f"{head}; --verbose prints them, and the run's scenario.yaml has them"
    yield from fitted.reasons


def _shown(value: Any) -> str:
    return json.dumps(value).replace(".0,", ",").replace(".0]", "]")
