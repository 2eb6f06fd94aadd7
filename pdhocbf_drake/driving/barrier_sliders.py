"""Sliders of a drive that change how a barrier is kept."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from pydrake.geometry import Meshcat

from pdhocbf_drake.driving.controls import GAMMAS, Kept
from pdhocbf_drake.walking.barrier_changes import KIND_OF_BOUND, Kind
from pdhocbf_drake.walking.barrier_config import WalkBarrierConfig

_KINDS: Final[tuple[Kind, ...]] = ("none", "constant", "periodic")
_MARGIN: Final = 0.01  # of a barrier whose bound follows no orbit, where its slider begins [unit of h]
_STEPS: Final = 20


def said_of(names: Iterable[str]) -> dict[str, str]:
    """What follows the first word of each barrier's controls: "of NAME", with a number where there are several.

    Meshcat shows some fourteen letters of a label, in which those of a barrier have to differ.
    """
    all_names = list(names)
    several = len(all_names) > 1
    return {name: f"{number} of {name}" if several else f"of {name}" for number, name in enumerate(all_names, start=1)}


class BarrierSliders:
    """Reads three sliders of one barrier: its kind of bound, its margin and its γ.

    Meshcat has sliders of numbers only, in multiples of a step: none, constant and periodic are 0, 1 and 2, and γ goes
    to the nearest of `GAMMAS`.

    Args:
        name: of the barrier. said: as in `said_of`.
    """

    def __init__(self, meshcat: Meshcat, name: str, said: str, config: WalkBarrierConfig) -> None:
        self._meshcat, self._name = meshcat, name
        margin = config.bound.margin or _MARGIN
        kind = _KINDS.index(KIND_OF_BOUND[config.bound.kind])
        labels = [f"bound {said}: none 0, constant 1, periodic 2", f"margin {said} [{config.unit}]", f"gamma {said}"]
        ranges = [(0.0, 2.0, 1.0), (0.0, 5.0 * margin, 5.0 * margin / _STEPS), (GAMMAS[0], GAMMAS[-1], 0.1)]
        self._start = dict(zip(labels, (float(kind), margin, _nearest(config.gamma[0])), strict=True))
        for label, limits in zip(labels, ranges, strict=True):
            meshcat.AddSlider(label, *limits, self._start[label])
        self._last = self._values()

    def reset(self) -> None:
        """Puts the sliders where they were at first."""
        for label, value in self._start.items():
            self._meshcat.SetSliderValue(label, value)
        self._last = self._values()

    def read(self) -> Kept | None:
        """What has been changed since the last call; None where nothing has."""
        before, self._last = self._last, self._values()
        kind, margin, gamma = (now if now != then else None for now, then in zip(self._last, before, strict=True))
        if kind is None and margin is None and gamma is None:
            return None
        return Kept(self._name, None if kind is None else _KINDS[round(kind)], margin, gamma)

    def _values(self) -> list[float]:
        kind, margin, gamma = [round(self._meshcat.GetSliderValue(label), 6) for label in self._start]
        if _nearest(gamma) != gamma:
            self._meshcat.SetSliderValue([*self._start][-1], _nearest(gamma))
        return [kind, margin, _nearest(gamma)]


def _nearest(gamma: float) -> float:
    """Of `GAMMAS`; in the middle between two the larger one."""
    return min(reversed(GAMMAS), key=lambda other: round(abs(other - gamma), 6))
