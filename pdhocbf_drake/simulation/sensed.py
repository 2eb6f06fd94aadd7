"""What the controller of a scenario is to expect of its measurements."""

from __future__ import annotations

from typing import Any, Final

from pdhocbf_drake.mpc.config import FilterConfig, MpcConfig
from pdhocbf_drake.simulation.scenario import Scenario

EXACT: Final[dict[str, Any]] = {"delay": 0, "zmp_lag": None, "filter": None, "disturbance": None}
"""`mpc` of a walk whose measurements are exact and that nothing disturbs, as a nominal one."""


def sensed(scenario: Scenario) -> MpcConfig:
    """The scenario's `mpc`, with delay and noise of its `measurement` where these are "auto"."""
    config, measurement = scenario.mpc, scenario.measurement
    found: dict[str, Any] = {}
    if config.delay == "auto":
        found["delay"] = measurement.late_ticks
    if config.filter == "auto":
        found["filter"] = FilterConfig(com=min(measurement.noise.com, 1.0), velocity=measurement.noise.velocity)
    return config.model_copy(update=found)
