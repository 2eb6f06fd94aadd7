"""The three cases that studies compare: a scenario without barriers, with constant ones, and with periodic ones."""

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
CASES: Final = (NONE, DCBF, PERIODIC)
_LENDER = "walking"  # the scenario whose barriers are taken where a scenario has none


def in_case(scenario: Scenario, case: str, gamma: float | None = None) -> Scenario:
    """The scenario with its barriers left out, with constant bounds, or with periodic ones.

    A constant bound is the extreme of the periodic one: the orbit's peak, that of a harmonic, or that of a table. A
    scenario without barriers gets those of `walking`.

    Args:
        scenario: the scenario.
        case: one of `CASES`.
        gamma: replaces every γ of every barrier; None keeps them.

    Raises:
        InputError: there is no such case.
    """
    if case == NONE:
        return scenario.model_copy(update={"barriers": {}})
    if case not in CASES:
        raise InputError(f"barriers are {', '.join(CASES)} (given: {case!r})")
    change = _constant if case == DCBF else _periodic
    barriers = {name: change(config) for name, config in (scenario.barriers or _lent()).items()}
    if gamma is not None:
        barriers = {n: c.model_copy(update={"gamma": (gamma,) * len(c.gamma)}) for n, c in barriers.items()}
    return scenario.model_copy(update={"barriers": barriers})


def lent_barriers(scenario: Scenario) -> str:
    """A sentence on the barriers that a scenario without barriers gets; empty if it has its own."""
    if scenario.barriers:
        return ""
    lent = _lent().items()
    bounds = ", ".join(f"{name} with a margin of {config.bound.margin:g} {config.unit}" for name, config in lent)
    return f"{scenario.name} has no barrier: {DCBF} and {PERIODIC} are those of {_LENDER} ({bounds})"


def _lent() -> dict[str, WalkBarrierConfig]:
    return load_scenario(_LENDER, "").barriers


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
