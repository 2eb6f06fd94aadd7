"""The keys of the gait and of its pendulum template: times in ticks, lengths in metres."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from pdhocbf_drake.config import Config, Length, within


class GaitConfig(Config):
    """A periodic walk along x.

    Attributes:
        tick: sampling interval δ of the controller [s].
        ticks_per_step: N, the period of forward velocity and CoM height [ticks]; a gait is two steps.
        double_support_ticks: ticks at the start of each step in which the ZMP box moves from the old
            stance foot to the new one; 0 is the paper's literal gait, in which the planned ZMP jumps.
        stride: commanded step length along x [m].
        stance_width: commanded lateral distance between the feet [m].
        zmp_box: side lengths of the ZMP box in x and y, eq. (27) [m].
        com_height: Z_com of eq. (24), above the ground [m].
        com_height_amplitude: Δ_z of eq. (24) [m].
        com_height_phase: the tick of a step at which eq. (24) is at its highest [ticks]. 0 is as a foot lands, the
            paper's letter; `middle` is tick N/2, about mid-stance, as people walk.
        swing_height: clearance of the swing sole at mid-swing [m].
        start_steps: step durations to stand on both feet before the first step.
        walk_steps: steps to take before coming to a stand again; 0 only stands, null walks on.
        first_stance: the foot that stands during the first step.
    """

    tick: Annotated[float, within(1e-4, 0.1, "s")] = 0.01
    ticks_per_step: int = Field(40, ge=4, le=10_000)
    double_support_ticks: int = Field(4, ge=0)
    stride: Annotated[float, within(-10.0, 10.0, "m")] = 0.15
    stance_width: Length = 0.16
    zmp_box: tuple[Length, Length] = (0.1, 0.1)
    com_height: Length = 0.58
    com_height_amplitude: float = Field(0.01, ge=0)
    com_height_phase: int | Literal["middle"] = 0
    swing_height: Annotated[float, within(0.0, 1.0, "m", above=True)] = 0.05
    start_steps: int = Field(2, ge=0, le=1000)
    walk_steps: int | None = Field(None, ge=0)
    first_stance: Literal["left", "right"] = "right"

    @property
    def ticks_per_gait(self) -> int:
        """Two steps: the period of the lateral motion [ticks]."""
        return 2 * self.ticks_per_step


class VhipConfig(Config):
    """The variable-height inverted pendulum as a plant; its height is the gait's.

    Attributes:
        mass: turns the force of a push into an acceleration; nothing else depends on it [kg].
    """

    mass: Annotated[float, within(1e-3, 1e6, "kg")] = 30.0
