"""Config of model errors and measurement errors."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from pdhocbf_drake.config import Config, within


class ModelErrorConfig(Config):
    """How the simulated robot differs from the controller's model of it.

    Attributes:
        torso_mass: mass and inertia of the simulated torso over those of the controller's model [1].
    """

    torso_mass: float = Field(1.0, gt=0, le=100)


class MeasurementNoise(Config):
    """Standard deviations of white noise, drawn anew at every tick, the same in x and y.

    Attributes:
        com: of the CoM [m].
        velocity: of the CoM velocity [m/s].
        zmp: of the ZMP [m].
    """

    com: Annotated[float, within(0.0, 10.0, "m")] = 0.0
    velocity: Annotated[float, within(0.0, 10.0, "m/s")] = 0.0
    zmp: Annotated[float, within(0.0, 10.0, "m")] = 0.0

    @property
    def deviations(self) -> list[float]:
        """One for each element of `lip_state`."""
        return [self.com, self.velocity, self.zmp] * 2


class MeasurementConfig(Config):
    """Errors of the estimate that the controller gets.

    Attributes:
        noise: added to the CoM and ZMP.
        delay_ticks: delay of CoM, ZMP and soles [ticks].
    """

    noise: MeasurementNoise = MeasurementNoise()
    delay_ticks: int = Field(0, ge=0, le=1000)
