"""From CoM and soles to joint targets and feedforward torques."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem, ValueProducer

from pdhocbf_drake.biped import (
    Biped,
    Feedforward,
    InverseDynamics,
    Posture,
    PostureRates,
    Side,
    WholeBodyIk,
    left_share_of_zmp,
    row_weights,
)

_LEVEL = np.zeros(3)


class _Answer(NamedTuple):
    motion: np.ndarray
    desired: np.ndarray
    feedforward: np.ndarray
    zmp: np.ndarray
    status: np.ndarray


class InverseKinematics(LeafSystem):
    """Whole-body inverse kinematics and inverse dynamics of the plan, solved once a tick.

    The outputs are functions of the inputs, which change once a tick, and of the last tick's motion, which is this
    block's discrete state (q, v, v̇: 19 + 18 + 18): the iteration starts where that motion leads.

    Input ports:
        com_height (3), com_reference (6), zmp_reference (4), foot_reference (18).
        gait_phase (3): tells which foot swings, so that this one is what misses its target where the legs are too
            short; may be left unconnected.
    Output ports:
        desired_state (24): joint targets, and the constant rates that lead there from the last ones [rad, rad/s].
        feedforward (12): torques of the planned motion [N m].
        whole_body_zmp (2): where the planned motion of all links puts the ZMP [m].
        ik_status (3): met (1 or 0), greatest error [m, rad], iterations.
    """

    def __init__(self, biped: Biped, initial: np.ndarray, tick: float) -> None:
        super().__init__()
        self._biped, self._period = biped, tick
        self._ik = WholeBodyIk(biped)
        self._dynamics = InverseDynamics(biped, self._ik.task_space)
        sizes = {"gait_phase": 3, "com_height": 3, "com_reference": 6, "zmp_reference": 4, "foot_reference": 18}
        ports = [self.DeclareVectorInputPort(name, size) for name, size in sizes.items()]
        self.DeclareDiscreteState(np.concatenate([initial, np.zeros(36)]))
        self.DeclarePeriodicDiscreteUpdateEvent(tick, 0.0, self._remember)
        changes = {self.xd_ticket(), *(port.ticket() for port in ports)}
        producer = ValueProducer(allocate=lambda: AbstractValue.Make(None), calc=self._solve)
        self._answer = self.DeclareCacheEntry("answer", producer, changes)
        entry = {self._answer.ticket()}
        self.DeclareVectorOutputPort("desired_state", 24, self._copy("desired"), entry)
        self.DeclareVectorOutputPort("feedforward", 12, self._copy("feedforward"), entry)
        self.DeclareVectorOutputPort("whole_body_zmp", 2, self._copy("zmp"), entry)
        self.DeclareVectorOutputPort("ik_status", 3, self._copy("status"), entry)

    def _evaluated(self, context: Context) -> _Answer:
        answer: _Answer = self._answer.Eval(context)
        return answer

    def _copy(self, part: str):  # type: ignore[no-untyped-def]
        return lambda context, output: output.SetFromVector(getattr(self._evaluated(context), part))

    def _remember(self, context: Context, values: DiscreteValues) -> None:
        values.set_value(self._evaluated(context).motion)

    def _swing_foot(self, context: Context) -> Side | None:
        """The foot that leaves the ground in this step, where that is known."""
        port = self.GetInputPort("gait_phase")
        support = port.Eval(context)[2] if port.HasValue(context) else 0.0
        sides: dict[float, Side] = {1.0: "right", -1.0: "left"}
        return sides.get(support)

    def _solve(self, context: Context, value: AbstractValue) -> None:
        state = context.get_discrete_state_vector().value()
        last, way = state[:19], self._period * (state[19:37] + 0.5 * self._period * state[37:])
        height = self.GetInputPort("com_height").Eval(context)
        x, vx, ax, y, vy, ay = self.GetInputPort("com_reference").Eval(context)
        zmp = self.GetInputPort("zmp_reference").Eval(context)[[0, 2]]
        # foot, derivative, axis
        feet = self.GetInputPort("foot_reference").Eval(context).reshape(2, 3, 3)
        com = np.array([[x, y, height[0]], [vx, vy, height[1]], [ax, ay, height[2]]])
        left, right = ([np.concatenate([foot[d], _LEVEL]) for d in range(3)] for foot in feet)

        loose = self._swing_foot(context)
        seed = self._ik.task_space.moved(last, way)
        found = self._ik.solve(Posture(com[0], left[0], right[0]), seed, loose)
        weights = None if found.ok else row_weights(loose)
        v = self._ik.rates(found.q, PostureRates(com[1], left[1], right[1]), weights)
        vdot = self._ik.accelerations(found.q, v, PostureRates(com[2], left[2], right[2]), weights)
        # In the air a foot carries nothing; on both feet the ZMP says which share each one carries.
        airborne = feet[:, 0, 2] > 0.0
        share = left_share_of_zmp(zmp, left[0][:2], right[0][:2])
        if airborne.any():
            share = 0.0 if airborne[0] else 1.0
        torque = self._dynamics(found.q, v, vdot, share)
        joints = self._biped.q_index
        rates = (found.q[joints] - last[joints]) / self._period
        value.set_value(
            _Answer(
                np.concatenate([found.q, v, vdot] if found.ok else [found.q, np.zeros(36)]),
                np.concatenate([found.q[joints], rates]),
                torque.tau,
                _zmp(torque, left[0], right[0]),
                np.array([found.ok, min(found.error, 1e3), found.iterations]),
            )
        )


def _zmp(torque: Feedforward, left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Point on the ground where the wrenches on both soles have no horizontal moment, shape (2,) [m]."""
    force = torque.left[:3] + torque.right[:3]
    about_x = about_y = 0.0
    for wrench, sole in ((torque.left, left), (torque.right, right)):
        (x, y, z), (fx, fy, fz, mx, my, _) = sole[:3], wrench
        about_x += mx + y * fz - z * fy
        about_y += my + z * fx - x * fz
    return np.array([-about_y, about_x]) / max(force[2], 1e-6)
