"""What a walk asks of the friction between its soles and the ground, from a log."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.analysis.heights import zmp_height
from pdhocbf_drake.analysis.robot_limits import RobotLimits
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.systems.kernels import LEAST_LOAD

Array = NDArray[np.float64]


def friction_used(log: RunLog, body: RobotLimits) -> Array:
    """|F_xy|/F_z of the ground's force F on both soles together, 0 where it carries nothing, (T,) [1]."""
    _, force = _ground_wrench(log, body)
    return _over_load(np.hypot(force[:, 0], force[:, 1]), force[:, 2], body)


def yaw_moment_used(log: RunLog, body: RobotLimits) -> Array:
    """|M_z|/F_z, M_z the ground's moment about the vertical through the ZMP, 0 where it carries nothing, (T,) [m].

    With M and F the ground's wrench about the base's origin b, and r = b − ZMP, M_z = M_z,b + r_x F_y − r_y F_x.
    """
    moment, force = _ground_wrench(log, body)
    place = log["robot_state"][:, body.base_origin].copy()
    place[:, 2] -= zmp_height(log)
    with np.errstate(divide="ignore", invalid="ignore"):  # ZMP − b as in `StateEstimator`
        ahead = -(moment[:, 1] + place[:, 2] * force[:, 0]) / force[:, 2]
        aside = (moment[:, 0] - place[:, 2] * force[:, 1]) / force[:, 2]
        about_zmp = moment[:, 2] - ahead * force[:, 1] + aside * force[:, 0]
    return _over_load(np.abs(about_zmp), force[:, 2], body)


def _ground_wrench(log: RunLog, body: RobotLimits) -> tuple[Array, Array]:
    """Moment about the base's origin and force of the ground in the world, (T, 3) each [N m, N]."""
    wrench = log["contact_forces"][:, body.base]
    return wrench[:, :3], wrench[:, 3:]


def _over_load(values: Array, load: Array, body: RobotLimits) -> Array:
    loaded = load > LEAST_LOAD * body.weight
    return np.divide(values, load, out=np.zeros_like(values), where=loaded)
