"""What has been made to fit a robot, in sentences."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from pdhocbf_drake.fitting.defaults import Fitted


def sentences(fitted: Fitted, robot: str) -> Iterator[str]:
    """The robot, every value that was changed with the packaged one's in brackets, and why the step is another one."""
    facts = fitted.facts
    values = ", ".join(f"{key} {_shown(new)} ({_shown(old)})" for key, (old, new) in fitted.changed.items())
    sole = " x ".join(f"{2.0 * half:.3g}" for half in facts.sole)
    yield f"values that fit {robot} (legs {facts.leg:.3g} m, {facts.mass:.3g} kg, soles {sole} m): {values}"
    yield from fitted.reasons


def _shown(value: Any) -> str:
    return json.dumps(value).replace(".0,", ",").replace(".0]", "]")
