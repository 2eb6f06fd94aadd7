"""Config of the Van der Pol oscillator and its tube."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from pdhocbf_drake.config import Config, within

_State = Annotated[float, Field(ge=-1000, le=1000)]


class VanDerPolConfig(Config):
    """The Van der Pol oscillator (15)-(16), held in a tube around a periodic orbit by the barriers (18).

    Attributes:
        beta: β of eq. (15) [1]; 0 is the harmonic oscillator of the paper's Fig. 1.
        tick: sampling interval δ [s].
        ticks_per_period: N of the tube [ticks], a choice, since 2π/δ is not a whole number.
        initial_state: x₁, x₂ at the start [1, 1/s].
        amplitude: radius of the harmonic orbit that the tube follows (β = 0) [1].
        tube: half widths of the tube around the orbit in x₁ and x₂ [1, 1/s].
        gamma_1: class-K slopes of the x₁ barriers, which have relative degree 2 [1].
        gamma_2: class-K slope of the x₂ barriers, which have relative degree 1 [1].
    """

    beta: float = Field(0.0, ge=0, le=1000)
    tick: Annotated[float, within(1e-4, 1.0, "s")] = 0.01
    ticks_per_period: int = Field(628, ge=2, le=10_000)
    initial_state: tuple[_State, _State] = (1.0, 0.0)
    amplitude: float = Field(1.0, gt=0, le=1000)
    tube: tuple[float, float] = (0.1, 0.1)
    gamma_1: tuple[float, ...] = (0.1, 0.1)
    gamma_2: tuple[float, ...] = (0.1,)
