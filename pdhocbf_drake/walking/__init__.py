"""Gait as data, support region, swing foot, CoM height, pendulum template, and the quantities that a barrier bounds."""

from typing import TYPE_CHECKING

from pdhocbf_drake.lazy import lazy_names

if TYPE_CHECKING:
    from pdhocbf_drake.walking.com_height import CosineHeight
    from pdhocbf_drake.walking.config import GaitConfig
    from pdhocbf_drake.walking.footsteps import Footstep, Footsteps
    from pdhocbf_drake.walking.gait import Gait
    from pdhocbf_drake.walking.support import SupportRegion
    from pdhocbf_drake.walking.swing import SwingPoint, swing_point

__all__ = [
    "CosineHeight",
    "Footstep",
    "Footsteps",
    "Gait",
    "GaitConfig",
    "SupportRegion",
    "SwingPoint",
    "swing_point",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "com_height": ("CosineHeight",),
        "config": ("GaitConfig",),
        "footsteps": (
            "Footstep",
            "Footsteps",
        ),
        "gait": ("Gait",),
        "support": ("SupportRegion",),
        "swing": (
            "SwingPoint",
            "swing_point",
        ),
    },
)
