"""Ticks and phases, stance sequence, ZMP boxes, CoM height and swing foot of a periodic walk."""

from pdhocbf_drake.walking.com_height import CosineHeight
from pdhocbf_drake.walking.config import GaitConfig
from pdhocbf_drake.walking.gait import Gait, Step
from pdhocbf_drake.walking.swing import SwingPoint, swing_point

__all__ = ["CosineHeight", "Gait", "GaitConfig", "Step", "SwingPoint", "swing_point"]
