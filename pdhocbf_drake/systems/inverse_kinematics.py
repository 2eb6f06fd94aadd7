"""From CoM and soles to joint targets and feedforward torques."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from pdhocbf_drake.jit import compiled
from pdhocbf_drake.robot import (
    Biped,
    InverseDynamics,
    Side,
    WholeBodyIk,
    left_share_of_zmp,
    zmp_of_wrenches,
)
from pdhocbf_drake.systems.unbundled import Unbundled

_SWINGING: dict[float, Side] = {1.0: "right", -1.0: "left"}  # by the foot that stands
_STILL = np.zeros(54)
_MOTION = 73  # this block's state, behind what it tells
_PARTS = {"desired_state": 24, "feedforward": 12, "whole_body_zmp": 2, "ik_status": 3}


class InverseKinematics(Unbundled):
    """Whole-body inverse kinematics and inverse dynamics of the plan, solved once a tick.

    The outputs are functions of the inputs, which change once a tick, and of the last tick's motion, which is this
    block's discrete state (q, v, v̇ and the v̇ before: 19 + 3 · 18): the iteration starts where that motion leads.

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
        super().__init__(_InverseKinematics(biped, initial, tick), _PARTS)


class _InverseKinematics(LeafSystem):
    """`InverseKinematics` with one output."""

    def __init__(self, biped: Biped, initial: np.ndarray, tick: float) -> None:
        super().__init__()
        self._period = tick
        self._ik = WholeBodyIk(biped)
        self._dynamics = InverseDynamics(biped, self._ik.task_space)
        sizes = {"gait_phase": 3, "com_height": 3, "com_reference": 6, "zmp_reference": 4, "foot_reference": 18}
        ports = [self.DeclareVectorInputPort(name, size) for name, size in sizes.items()]
        self._phase, self._height, self._com, self._zmp, self._feet = ports
        self._joints = biped.q_index
        self.DeclareDiscreteState(np.concatenate([initial, _STILL]))
        self.DeclarePeriodicDiscreteUpdateEvent(tick, 0.0, self._remember)
        changes = {self.xd_ticket(), *(port.ticket() for port in ports)}
        self._answer = self.DeclareVectorOutputPort("answer", sum(_PARTS.values()) + _MOTION, self._calc, changes)

    def _remember(self, context: Context, values: DiscreteValues) -> None:
        values.set_value(self._answer.Eval(context)[-_MOTION:])

    def _swing_foot(self, context: Context) -> Side | None:
        """The foot that leaves the ground in this step, where that is known."""
        if not self._phase.HasValue(context):
            return None
        return _SWINGING.get(self._phase.Eval(context)[2])

    def _calc(self, context: Context, output: BasicVector) -> None:
        state = context.get_discrete_state_vector().value()
        last, way, wanted = state[:19], np.empty(18), np.zeros((3, 18))
        _write_way(state, self._period, way)
        _write_wanted(self._com.Eval(context), self._height.Eval(context), self._feet.Eval(context), wanted)
        seed = self._ik.task_space.moved(last, way)
        moving = self._ik.level_motion(wanted, seed, self._swing_foot(context))
        q, found = moving.q, moving.ik
        # In the air a foot carries nothing; on both feet the ZMP says which share each one carries.
        left, right = wanted[0, 6:9], wanted[0, 12:15]
        if left[2] > 0.0:
            share = 0.0
        elif right[2] > 0.0:
            share = 1.0
        else:
            share = left_share_of_zmp(self._zmp.Eval(context)[::2], left, right)
        torque = self._dynamics(q, moving.v, moving.vdot, share)
        targets = np.empty(24)
        _write_targets(q, last, self._joints, self._period, targets)
        zmp = zmp_of_wrenches(torque.left, left, torque.right, right)
        status = found.ok, min(found.error, 1e3), found.iterations
        motion = (q, moving.v, moving.vdot, state[37:55]) if found.ok else (q, _STILL)
        output.SetFromVector(np.concatenate([targets, torque.tau, zmp, status, *motion]))


@compiled
def _write_way(state: np.ndarray, period: float, way: np.ndarray) -> None:
    """How far the last motion goes in a tick if v̇ goes on as it changed last, (18,)."""
    for i in range(18):
        v, vdot, before = state[19 + i], state[37 + i], state[55 + i]
        way[i] = period * (v + period * (vdot / 2.0 + (vdot - before) / 6.0))


@compiled
def _write_targets(q: np.ndarray, last: np.ndarray, joints: np.ndarray, period: float, out: np.ndarray) -> None:
    """Joint angles, then the constant rates that lead there from the last ones."""
    count = len(joints)
    for i in range(count):
        out[i] = q[joints[i]]
        out[count + i] = (q[joints[i]] - last[joints[i]]) / period


@compiled
def _write_wanted(com: np.ndarray, height: np.ndarray, feet: np.ndarray, wanted: np.ndarray) -> None:
    """What `WholeBodyIk.level_motion` wants, (3, 18), but for what stays zero."""
    for order in range(3):
        wanted[order, 0], wanted[order, 1], wanted[order, 2] = com[order], com[3 + order], height[order]
        for axis in range(3):
            wanted[order, 6 + axis] = feet[3 * order + axis]
            wanted[order, 12 + axis] = feet[9 + 3 * order + axis]
