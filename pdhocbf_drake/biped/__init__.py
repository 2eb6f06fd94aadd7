"""A robot as data: loading, frames and soles, whole-body inverse kinematics, feedforward torques."""

from pdhocbf_drake.biped.config import ROLES, SIDES, RobotConfig, Side
from pdhocbf_drake.biped.damped import row_weights
from pdhocbf_drake.biped.feedforward import Feedforward, InverseDynamics
from pdhocbf_drake.biped.ground import left_share_of_zmp, zmp_of_wrenches
from pdhocbf_drake.biped.ik import IkResult, Motion, WholeBodyIk
from pdhocbf_drake.biped.locate import load_robot_config, models_folder, robot_file, robot_names
from pdhocbf_drake.biped.posture import Posture, PostureRates, sole_pose
from pdhocbf_drake.biped.reach import check_walk, check_zmp_box
from pdhocbf_drake.biped.robot import Biped, Sole
from pdhocbf_drake.biped.swing_lever import swing_lever

__all__ = [
    "ROLES",
    "SIDES",
    "Biped",
    "Feedforward",
    "IkResult",
    "InverseDynamics",
    "Motion",
    "Posture",
    "PostureRates",
    "RobotConfig",
    "Side",
    "Sole",
    "WholeBodyIk",
    "check_walk",
    "check_zmp_box",
    "left_share_of_zmp",
    "load_robot_config",
    "models_folder",
    "robot_file",
    "robot_names",
    "row_weights",
    "sole_pose",
    "swing_lever",
    "zmp_of_wrenches",
]
