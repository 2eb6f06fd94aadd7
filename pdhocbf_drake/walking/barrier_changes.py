"""Barriers that are changed while a walk goes on: another kind of bound, another margin, another γ."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, Final, Literal, NamedTuple

from pydantic import Field, field_validator, model_validator

from pdhocbf_drake.config import Config, Name, within
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.walking.barrier_config import WalkBarrierConfig

Kind = Literal["none", "constant", "periodic"]
KIND_OF_BOUND: Final[dict[str, Kind]] = {
    "constant": "constant", "orbit_peak": "constant", "harmonic": "periodic", "tabulated": "periodic",
    "orbit": "periodic",
}  # fmt: skip
"""The kind of a barrier by that of its bound in a scenario."""
_ROUNDING: Final = 1e-6  # [ticks]
_OF_ORBIT: Final[dict[Kind, str]] = {"constant": "orbit_peak", "periodic": "orbit"}


class BarrierChange(Config):
    """A barrier that is kept in another way from a time on; what is left out stays as it is.

    Attributes:
        time: from when on [s].
        name: of the barrier.
        kind: "none" does not keep it; "periodic" is a bound along the nominal orbit, or the barrier's own one if that
            is harmonic or tabulated; "constant" is one above the orbit's peak, or the barrier's own constant.
        margin: distance of a bound from the orbit that it follows [unit of h].
        gamma: γ_1, …, γ_m in (0, 1], or one number for all of them [1].
    """

    time: float = Field(ge=0)
    name: Name
    kind: Kind | None = None
    margin: Annotated[float, within(0.0, 1e3, "unit of h")] | None = None
    gamma: tuple[Annotated[float, within(0.0, 1.0, "1", above=True)], ...] | None = Field(None, min_length=1)

    @field_validator("gamma", mode="before")
    @classmethod
    def _one_for_all(cls, gamma: Any) -> Any:
        return (gamma,) if isinstance(gamma, (int, float)) else tuple(gamma) if isinstance(gamma, list) else gamma

    @model_validator(mode="after")
    def _changes_something(self) -> BarrierChange:
        if self.kind is None and self.margin is None and self.gamma is None:
            raise ValueError("a change of a barrier has a kind, a margin or a gamma")
        return self


class Setting(NamedTuple):
    """How a barrier is kept.

    Attributes:
        kind: of its bound; None is its own one.
        margin: of a bound that follows an orbit [unit of h].
        gamma: of its class-K functions.
    """

    kind: Kind | None
    margin: float
    gamma: tuple[float, ...]

    def bound(self, config: WalkBarrierConfig) -> WalkBarrierConfig:
        """The barrier with this bound, where it has one."""
        own = config.bound
        kind = KIND_OF_BOUND[own.kind] if self.kind is None else self.kind
        if not own.follows_orbit and kind == KIND_OF_BOUND[own.kind]:
            return config
        data: dict[str, Any] = {"kind": _OF_ORBIT[kind], "margin": self.margin, "stride": own.stride}
        return config.model_copy(update={"bound": type(own)(**data)})


Settings = tuple[Setting, ...]


class BarrierSettings:
    """How all barriers of a walk are kept, tick by tick; a driver adds to it while the walk goes on.

    Args:
        barriers: those of the scenario, in order.
        tick: δ [s].

    Attributes:
        prepare: makes what settings need before they are added; raises `InputError` where they can't be.
    """

    def __init__(self, barriers: Mapping[str, WalkBarrierConfig], tick: float) -> None:
        self._barriers, self._delta = barriers, tick
        own = [Setting(None, config.bound.margin or 0.0, config.gamma) for config in barriers.values()]
        self._ticks, self._settings = [0], [tuple(own)]
        self.prepare: Callable[[Sequence[Setting]], None] = lambda settings: None

    def at(self, tick: int) -> Settings:
        """How each barrier is kept at tick k."""
        return self._settings[max(bisect_right(self._ticks, tick) - 1, 0)]

    def clear(self) -> None:
        """Leaves those of the start."""
        del self._ticks[1:], self._settings[1:]

    def add(self, change: BarrierChange, where: str = "barrier_changes") -> None:
        """Puts a change into force from the first tick at its time or after it.

        Raises:
            InputError: there is no such barrier, or it has no such margin or γ, or the change is before the last one.
        """
        names = [*self._barriers]
        if change.name not in names:
            there = ", ".join(names) or "none"
            raise InputError(f"{where}.name: must be a barrier of the scenario: {there} (given: {change.name})")
        tick, place = math.ceil(change.time / self._delta - _ROUNDING), names.index(change.name)
        if tick < self._ticks[-1]:
            last = self._ticks[-1] * self._delta
            raise InputError(f"{where}.time: must not be before the change before it, {last:g} s ({change.time:g})")
        settings, config = [*self._settings[-1]], self._barriers[change.name]
        settings[place] = self._changed(settings[place], change, config, where)
        self.prepare(settings)
        if tick == self._ticks[-1]:
            self._settings[-1] = tuple(settings)
        else:
            self._ticks.append(tick)
            self._settings.append(tuple(settings))

    def _changed(self, before: Setting, change: BarrierChange, config: WalkBarrierConfig, where: str) -> Setting:
        kind = before.kind if change.kind is None else change.kind
        margin = before.margin if change.margin is None else change.margin
        gamma, order = change.gamma or before.gamma, len(config.gamma)
        if len(gamma) not in (1, order):
            raise InputError(f"{where}.gamma: must be one number, or {order} of them (given: {len(gamma)})")
        after = Setting(kind, margin, gamma if len(gamma) == order else gamma * order)
        if change.margin is not None and kind != "none" and not after.bound(config).bound.follows_orbit:
            own = config.bound.kind
            raise InputError(f'{where}.margin: the bound of {change.name} is "{own}" then, which follows no orbit')
        return after
