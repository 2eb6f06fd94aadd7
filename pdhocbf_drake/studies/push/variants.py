"""The same scenario under no barrier, under constant ones (DCBF) and under periodic ones (P-DHOCBF)."""

from __future__ import annotations

import math
from typing import Final

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.walking.barrier_config import WalkBarrierConfig, WalkBoundConfig

NONE: Final = "none"
DCBF: Final = "DCBF"
PERIODIC: Final = "P-DHOCBF"
BARRIERS: Final = (NONE, DCBF, PERIODIC)
_USUAL = "walking"  # whose barrier is taken where a scenario has none


def variant(scenario: Scenario, barrier: str) -> Scenario:
    """The scenario with its barriers left out, made constant, or made periodic.

    A constant bound clears the periodic one over the whole period: the orbit's peak, the extreme of a harmonic or
    a table. A scenario without barriers gets that of `walking`.

    Raises:
        InputError: there is no such kind.
    """
    if barrier == NONE:
        return scenario.model_copy(update={"barriers": {}})
    if barrier not in BARRIERS:
        raise InputError(f"barriers are {', '.join(BARRIERS)} (given: {barrier!r})")
    own = scenario.barriers or _usual()
    change = _constant if barrier == DCBF else _periodic
    return scenario.model_copy(update={"barriers": {name: change(config) for name, config in own.items()}})


def told_of_borrowed(scenario: Scenario) -> str:
    """What to say of a scenario without barriers, with which those of another one are compared; else nothing."""
    if scenario.barriers:
        return ""
    bounds = ", ".join(
        f"{name} with a margin of {config.bound.margin:g} {config.unit}" for name, config in _usual().items()
    )
    return f"{scenario.name} has no barrier: {DCBF} and {PERIODIC} are those of {_USUAL} ({bounds})"


def _usual() -> dict[str, WalkBarrierConfig]:
    return load_scenario(_USUAL, "").barriers


def with_gamma(scenario: Scenario, gamma: float) -> Scenario:
    """The scenario with every γ of every barrier replaced."""
    changed = {
        name: config.model_copy(update={"gamma": (gamma,) * len(config.gamma)})
        for name, config in scenario.barriers.items()
    }
    return scenario.model_copy(update={"barriers": changed})


def _constant(config: WalkBarrierConfig) -> WalkBarrierConfig:
    bound, upper = config.bound, config.side == "upper"
    if bound.kind == "orbit":
        return _with(config, bound.model_copy(update={"kind": "orbit_peak"}))
    if bound.kind == "harmonic":
        swing = math.hypot(bound.cosine or 0.0, bound.sine or 0.0)
        value = (bound.mean or 0.0) + (swing if upper else -swing)
        return _with(config, WalkBoundConfig(kind="constant", value=value))
    if bound.kind == "tabulated" and bound.values:
        return _with(config, WalkBoundConfig(kind="constant", value=max(bound.values) if upper else min(bound.values)))
    return config


def _periodic(config: WalkBarrierConfig) -> WalkBarrierConfig:
    if config.bound.kind == "orbit_peak":
        return _with(config, config.bound.model_copy(update={"kind": "orbit"}))
    return config


def _with(config: WalkBarrierConfig, bound: WalkBoundConfig) -> WalkBarrierConfig:
    return config.model_copy(update={"bound": bound})
