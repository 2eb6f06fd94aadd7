"""What a walk over uneven ground asks of the joints, without a simulation."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.fitting.uneven_walk import step_motion
from pdhocbf_drake.robot import Biped, InverseDynamics, WholeBodyIk
from pdhocbf_drake.robot.posture import COM, TargetPoses
from pdhocbf_drake.walking import Gait

_EVERY = 2  # ticks of which the motion is looked at


class Effort(NamedTuple):
    """Largest joint torques (12,) [N m] and joint speeds, before they are limited (12,) [rad/s], of some steps."""

    torques: np.ndarray
    speeds: np.ndarray


def uneven_effort(biped: Biped, gait: Gait, steps: Iterable[int]) -> Effort:
    """The effort of steps, each with the ZMP in the middle of its stance foot; from a posture out of reach on none."""
    ik = WholeBodyIk(biped)
    task, torques, speeds = ik.task_space, np.zeros(12), np.zeros(12)
    dynamics = InverseDynamics(biped, task)
    for step in steps:
        q, on_left = biped.bent_knee.copy(), float(gait.step(step).side > 0)
        for k, (wanted, angles) in enumerate(step_motion(gait, step, _EVERY)):
            if k == 0:
                q[biped.base_q_index[4:]] = wanted[0, COM]
            found = ik.solve_poses(TargetPoses(wanted[0], *angles), q)
            if not found.ok:
                break
            q = found.q
            task.set_positions(q)
            v = task.solve(wanted[1])
            if v is None:
                break
            task.set_state(q, v)
            vdot = task.solve(wanted[2] - task.bias())
            if vdot is None:
                break
            torques = np.maximum(torques, abs(dynamics(q, v, vdot, on_left).tau))
            speeds = np.maximum(speeds, abs(v[biped.v_index]))
    return Effort(torques, speeds)
