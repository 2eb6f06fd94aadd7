"""Ticks of a walk as the whole-body layer gets them, for its tests."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from pdhocbf_drake.robot import Biped, InverseDynamics, WholeBodyIk, sole_pose, upright_posture
from pdhocbf_drake.robot.grip import Grip
from pdhocbf_drake.robot.kernels import left_share
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.systems.kernels import write_wanted
from pdhocbf_drake.whole_body.config import WholeBodyConfig
from pdhocbf_drake.whole_body.deviation import TASKS, Deviation
from pdhocbf_drake.whole_body.layer import Moving, WholeBody
from pdhocbf_drake.whole_body.memory import BodyMemory

TICK = 0.01
NOWHERE = Deviation(np.zeros(TASKS), np.zeros(TASKS))


@dataclass
class Body:
    """A robot, its kinematics and dynamics, and the layer that keeps its limits.

    `effort` [N m] and `friction` [1] take the place of the robot's own limits.
    """

    effort: np.ndarray | None = None
    friction: float = 0.8

    def __post_init__(self) -> None:
        self.biped = copy(Biped.load("biped"))
        if self.effort is not None:
            self.biped.effort_limits = self.effort
        self.ik = WholeBodyIk(self.biped)
        self.dynamics = InverseDynamics(self.biped, self.ik.task_space)
        stand = upright_posture(self.biped, np.array([0.0, 0.0, 0.58]), sole_pose(0.0, 0.08), sole_pose(0.0, -0.08))
        self.grip = Grip.of(self.biped, stand, self.friction, (0.08, 0.08))
        self.stand = stand

    def layer(self, **config: Any) -> WholeBody:
        return WholeBody(self.biped, self.ik.task_space, WholeBodyConfig(**config), TICK, self.grip)

    def ticks(self, log: RunLog) -> Iterator[Moving]:
        """The closed form of each tick of a log; the task space is set to the one that is yielded last."""
        q, last = self.stand, np.zeros(12)
        for k in range(len(log)):
            wanted = np.zeros((3, TASKS))
            write_wanted(log["com_reference"][k], log["com_height"][k], log["foot_reference"][k], wanted)
            swing = {1.0: "right", -1.0: "left"}.get(log["gait_phase"][k, 2])
            q, v, vdot, found = self.ik.motion(wanted, q, swing)
            assert found.ok
            share = left_share(wanted[0, 6:9], wanted[0, 12:15], log["zmp_reference"][k, [0, 2]])
            torque = self.dynamics(q, v, vdot, share)
            yield Moving(q, v, vdot, torque, share, swing, BodyMemory.start(last, 1), 0)
            last = torque.tau
