"""A robot as data: loading, frames and soles, whole-body inverse kinematics, inverse dynamics."""

from typing import TYPE_CHECKING

from pdhocbf_drake.lazy import lazy_names

if TYPE_CHECKING:
    from pdhocbf_drake.robot.biped import Biped, Sole
    from pdhocbf_drake.robot.config import SIDES, RobotConfig, Side
    from pdhocbf_drake.robot.feedforward import Feedforward, InverseDynamics, swing_lever
    from pdhocbf_drake.robot.ik import IkResult, Motion, WholeBodyIk
    from pdhocbf_drake.robot.kernels import left_share_of_zmp, zmp_of_wrenches
    from pdhocbf_drake.robot.locate import load_robot_config, models_folder, robot_names
    from pdhocbf_drake.robot.per_joint import ROLES
    from pdhocbf_drake.robot.posture import Posture, sole_pose
    from pdhocbf_drake.robot.reach import check_apart, check_walk, check_zmp_box, longest_stride, upright_posture

__all__ = [
    "ROLES",
    "SIDES",
    "Biped",
    "Feedforward",
    "IkResult",
    "InverseDynamics",
    "Motion",
    "Posture",
    "RobotConfig",
    "Side",
    "Sole",
    "WholeBodyIk",
    "check_apart",
    "check_walk",
    "check_zmp_box",
    "left_share_of_zmp",
    "load_robot_config",
    "longest_stride",
    "models_folder",
    "robot_names",
    "sole_pose",
    "swing_lever",
    "upright_posture",
    "zmp_of_wrenches",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "biped": (
            "Biped",
            "Sole",
        ),
        "config": (
            "SIDES",
            "RobotConfig",
            "Side",
        ),
        "feedforward": (
            "Feedforward",
            "InverseDynamics",
            "swing_lever",
        ),
        "ik": (
            "IkResult",
            "Motion",
            "WholeBodyIk",
        ),
        "kernels": (
            "left_share_of_zmp",
            "zmp_of_wrenches",
        ),
        "locate": (
            "load_robot_config",
            "models_folder",
            "robot_names",
        ),
        "per_joint": ("ROLES",),
        "posture": (
            "Posture",
            "sole_pose",
        ),
        "reach": (
            "check_apart",
            "check_walk",
            "check_zmp_box",
            "longest_stride",
            "upright_posture",
        ),
    },
)
