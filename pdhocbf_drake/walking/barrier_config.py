"""What a user writes about a barrier of a walk: the quantity that it bounds, and the walk of its orbit."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from pydantic import Field, model_validator

from pdhocbf_drake.barriers import BarrierConfig, BoundConfig
from pdhocbf_drake.barriers.config import Keys
from pdhocbf_drake.walking.quantities import QUANTITIES, SPEEDS, Axis, Quantity, QuantityName


class WalkBoundConfig(BoundConfig):
    """A periodic bound V̄(k) of a quantity of a walk.

    k counts from the first tick of a step, at which the foot before has landed; where the quantity repeats after two
    steps, from that of an even one, the walk's very first being step 0.

    Attributes:
        stride: take the orbit of a walk with this stride instead of the commanded one [m].
    """

    KEYS: ClassVar[dict[str, tuple[Keys, Keys]]] = {
        kind: (needed, (*optional, "stride") if "margin" in optional else optional)
        for kind, (needed, optional) in BoundConfig.KEYS.items()
    }

    stride: float | None = None


class WalkBarrierConfig(BarrierConfig):
    """A barrier h = V̄(k) − q (upper) or q − V̄(k) (lower) on a quantity q of the template.

    Without `quantity` and `axis` it is one on the forward speed. One that has a `quantity` bounds the settled walk:
    while the walk starts and ends, its bound is the outer envelope of V̄ and of the stand, see `BoundSamples`.

    Attributes:
        quantity: the bounded quantity, one of `QUANTITIES`. Positions are seen from the stance foot.
        mirrored: count a quantity across the heading towards the other foot, so that it repeats after one step; null
            does so where `quantity` names it, and not where `axis` does.
        axis: the axis whose CoM velocity is bounded; a quantity's short name in older scenarios.
        gamma: γ_1, …, γ_m in (0, 1], one per class-K function [1]; left out, 0.5 for each tick of the quantity's
            relative degree r under the ZMP velocity.
        unit: unit of h; left out, that of the quantity.
    """

    quantity: QuantityName | None = None
    mirrored: bool | None = None
    axis: Axis | None = None
    bound: WalkBoundConfig
    gamma: tuple[float, ...] = Field((), min_length=1)
    unit: str = ""

    @property
    def bounded(self) -> Quantity:
        """The bounded quantity."""
        named = SPEEDS["xy".index(self.axis or "x")] if self.quantity is None else QUANTITIES[self.quantity]
        across = named.axis == 1 and self.quantity is not None
        return replace(named, mirrored=across if self.mirrored is None else self.mirrored)

    @model_validator(mode="after")
    def _quantity_fits(self) -> WalkBarrierConfig:
        if self.quantity is not None and self.axis is not None:
            raise ValueError(
                f"quantity {self.quantity} and axis {self.axis} are given, but one barrier bounds one quantity: leave "
                "axis out, or make it null where a scenario that this one extends has it"
            )
        quantity = self.bounded
        if quantity.mirrored and quantity.axis == 0:
            across = ", ".join(name for name, other in QUANTITIES.items() if other.axis == 1)
            raise ValueError(f"mirrored is for what is counted across the heading, {across} (given: {quantity.name})")
        self.__dict__["gamma"] = self.gamma or (0.5,) * quantity.relative_degree
        self.__dict__["unit"] = self.unit or quantity.unit
        return self

    @model_validator(mode="after")
    def _linear_class_k(self) -> WalkBarrierConfig:
        if self.class_k != "linear":
            raise ValueError(
                f'class_k is "linear" in a scenario, because its MPC is a quadratic program, given "{self.class_k}"; '
                "from Python, BarrierFilter and add_nonlinear_barrier_rows take any"
            )
        return self
