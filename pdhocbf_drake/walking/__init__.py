"""Gait as data, support region, swing foot, CoM height, pendulum template, and the quantities that a barrier bounds."""

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
