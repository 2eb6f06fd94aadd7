"""Ticks and phases, stance sequence, ZMP boxes, CoM height and swing foot of a periodic walk."""

from pdhocbf_drake.gait.com_height import CosineHeight
from pdhocbf_drake.gait.config import GaitConfig
from pdhocbf_drake.gait.gait import Gait, Step
from pdhocbf_drake.gait.swing import SwingPoint, swing_point

__all__ = ["CosineHeight", "Gait", "GaitConfig", "Step", "SwingPoint", "swing_point"]
