"""What a user writes about a barrier of a walk: the axis whose CoM velocity it bounds, and the walk of its orbit."""

from __future__ import annotations

from typing import ClassVar

from pydantic import model_validator

from pdhocbf_drake.barriers import BarrierConfig, BoundConfig
from pdhocbf_drake.barriers.config import Keys
from pdhocbf_drake.walking.quantities import SPEEDS, Axis, Quantity


class WalkBoundConfig(BoundConfig):
    """A periodic bound V̄(k) of a quantity of a walk.

    Attributes:
        stride: take the orbit of a walk with this stride instead of the commanded one [m].
    """

    KEYS: ClassVar[dict[str, tuple[Keys, Keys]]] = {
        kind: (needed, (*optional, "stride") if "margin" in optional else optional)
        for kind, (needed, optional) in BoundConfig.KEYS.items()
    }

    stride: float | None = None


class WalkBarrierConfig(BarrierConfig):
    """A barrier h = V̄(k) − v (upper) or v − V̄(k) (lower) on one axis of the template's CoM velocity v.

    Attributes:
        axis: the axis whose velocity is bounded.
    """

    axis: Axis = "x"
    bound: WalkBoundConfig
    unit: str = SPEEDS[0].unit

    @property
    def quantity(self) -> Quantity:
        """The bounded quantity."""
        return SPEEDS["xy".index(self.axis)]

    @model_validator(mode="after")
    def _linear_class_k(self) -> WalkBarrierConfig:
        if self.class_k != "linear":
            raise ValueError(
                f'class_k is "linear" in a scenario, because its MPC is a quadratic program, given "{self.class_k}"; '
                "from Python, BarrierFilter and add_nonlinear_barrier_rows take any"
            )
        return self
