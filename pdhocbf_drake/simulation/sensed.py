"""What the controller of a scenario is to expect of its measurements."""

from __future__ import annotations

from typing import Any, Final

from pdhocbf_drake.mpc.config import NARROW_BAND, WIDE_BAND, FilterConfig, MpcConfig
from pdhocbf_drake.simulation.scenario import Scenario

_FAR_OFF: Final = 2e-3  # of an encoder's zero position, which tilts what is believed as w = g times that [rad]
EXACT: Final[dict[str, Any]] = {"delay": 0, "zmp_lag": None, "filter": None, "disturbance": None}
"""`mpc` of a walk whose measurements are exact and that nothing disturbs, as a nominal one."""


def sensed(scenario: Scenario) -> MpcConfig:
    """The scenario's `mpc`, with delay, noise and band of its `measurement` where these are "auto"."""
    config, measurement = scenario.mpc, scenario.measurement
    found: dict[str, Any] = {}
    if config.delay == "auto":
        found["delay"] = measurement.late_ticks
    if config.filter == "auto":
        found["filter"] = FilterConfig(com=min(measurement.noise.com, 1.0), velocity=measurement.noise.velocity)
    disturbance = config.disturbance
    if disturbance is not None and disturbance.band == "auto":
        tilted = measurement.source == "sensors" and measurement.encoders.left_offset > _FAR_OFF
        found["disturbance"] = disturbance.model_copy(update={"band": NARROW_BAND if tilted else WIDE_BAND})
    return config.model_copy(update=found)
