"""Phases of the gait at which events begin, and directions in which they act, as commands take them."""

from __future__ import annotations

from typing import Final

import numpy as np

from pdhocbf_drake.errors import InputError

DIRECTIONS: Final = {"+x": 0.0, "+y": 90.0, "-x": 180.0, "-y": 270.0}
"""Angle about the vertical, from straight ahead towards the left [deg]."""
_WORDS = {"forward": "+x", "backward": "-x", "left": "+y", "right": "-y"}


def parse_directions(text: str) -> list[str]:
    """Names of directions from a list such as "+x,-y" or "forward,left"; raises `InputError`."""
    names = [_WORDS.get(word.strip(), word.strip()) for word in text.split(",") if word.strip()]
    if not names or any(name not in DIRECTIONS for name in names):
        words = ", ".join(f"{name} ({word})" for word, name in _WORDS.items())
        raise InputError(f"--directions: a list of {words} is needed, such as +x,+y (given: {text!r})")
    return list(dict.fromkeys(names))


def parse_phases(text: str, ticks_per_gait: int) -> list[int]:
    """Ticks of the gait from a list such as "0,10,20", or one number of evenly spread ones; raises `InputError`."""
    try:
        numbers = [int(word) for word in text.split(",") if word.strip()]
    except ValueError:
        numbers = []
    if len(numbers) == 1 and "," not in text and 1 <= numbers[0] <= ticks_per_gait:
        return [ticks_per_gait * i // numbers[0] for i in range(numbers[0])]
    if numbers and ("," in text) and all(0 <= number < ticks_per_gait for number in numbers):
        return sorted(set(numbers))
    raise InputError(
        f"--phases: either how many, 1 to {ticks_per_gait}, or a list of ticks of the gait, 0 to {ticks_per_gait - 1}, "
        f"such as 0,10,20 (given: {text!r})"
    )


def force(direction: str, impulse: float, duration: float) -> np.ndarray:
    """The constant force (3,) [N] that gives an impulse [N s] in a duration [s]."""
    angle = np.radians(DIRECTIONS[direction])
    return np.round([np.cos(angle), np.sin(angle), 0.0], 12) * impulse / duration
