"""From CoM and soles to joint targets and feedforward torques."""

from __future__ import annotations

import math

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from pdhocbf_drake.robot import (
    Biped,
    InverseDynamics,
    Side,
    WholeBodyIk,
    zmp_of_wrenches,
)
from pdhocbf_drake.robot.grip import Grip
from pdhocbf_drake.robot.ik import LEVEL
from pdhocbf_drake.robot.kernels import left_share, left_share_of_zmp, use_of_ground
from pdhocbf_drake.robot.posture import COM, LEFT, LEFT_TURN, RIGHT, RIGHT_TURN, TORSO_TURN
from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.systems.disturbed import is_disturbed
from pdhocbf_drake.systems.kernels import write_motion, write_step, write_wanted
from pdhocbf_drake.systems.optional_input import OptionalInput
from pdhocbf_drake.systems.signals import places, size, sizes, stretch
from pdhocbf_drake.systems.torso_yaw import TorsoYaw, add_to
from pdhocbf_drake.whole_body.config import WholeBodyConfig
from pdhocbf_drake.whole_body.ticks import BodyTicks, Clock

_INPUTS = ("gait_phase", "com_height", "com_reference", "zmp_reference", "foot_reference")
_OUTPUTS = ("desired_state", "feedforward", "whole_body_zmp", "ik_status")
_SWING_FOOT: dict[float, Side] = {1.0: "right", -1.0: "left"}  # by the stance foot
_TURNS = [turn.start + 2 for turn in (LEFT_TURN, RIGHT_TURN, TORSO_TURN)]  # about the vertical
_LARGEST_ERROR = 1e3  # in ik_status, where a refused target has an infinite one
(_SUPPORT,) = places("gait_phase", "support")
_ZMP = stretch("zmp_reference", "x_zmp", "y_zmp")
(_Z_ZMP,) = places("ground_reference", "z_zmp")
_ALOFT = stretch("ground_reference", "left_aloft", "right_aloft")
_TILTS = [slice(start, start + 6) for start in places("ground_reference", "left_roll", "right_roll")]


class InverseKinematics(Block):
    """Whole-body inverse kinematics and inverse dynamics of the plan, solved once a tick.

    The outputs are functions of the inputs, which change once a tick, and of the last tick's motion, which is this
    block's discrete state (q, v, v̇ and the v̇ before: 19 + 3 · 18): the iteration starts where that motion leads. Two
    more numbers are the deviation of the torso's yaw from its reference and its rate: where the planned motion asks
    more of the ground about the vertical than the soles' grip, the torso's yaw acceleration gives way, and comes back.
    Behind them is what the whole-body layer remembers, see `whole_body`, where there is one.

    Input ports:
        com_height (3), com_reference (6), zmp_reference (4), foot_reference (18): as in `systems.signals`.
        turn_reference (9): as in `systems.signals`, of a walk that turns; in others all face ahead.
        ground_reference (18): as in `systems.signals`, of a walk on uneven ground; in others it is level, at z = 0.
        gait_phase (3): its support determines the swing foot, which is the one to miss its target where the legs are
            too short; may be left unconnected.
        actuation (12): torques applied, which the whole-body layer learns from.
        solver_status (6): of a layer that forgets what it has learned where the walk is disturbed.
    Output parts, see `unbundled`:
        desired_state (24): joint targets, and the constant rates that lead there from the last ones [rad, rad/s].
        feedforward (12): torques of the planned motion [N m].
        whole_body_zmp (2): ZMP of the planned motion of all links [m].
        ik_status (3): met (1 or 0), greatest error [m, rad], iterations.
        whole_body (5): as in `systems.signals`, first among the parts; of a walk with a whole-body layer.

    Attributes:
        layer: the whole-body layer, of a walk that has one.
        feedforward: where the torques are among the parts. forgets: as below.

    Args:
        initial: q at the start (19,).
        tick: δ [s].
        turns: whether the walk may turn.
        grip: of the soles; without one the torso always keeps to its reference.
        uneven: whether the ground is not level.
        whole_body, ticks_per_step: config of the whole-body layer, which needs a grip, and N; None for no layer.
        forgets: whether the layer forgets in a disturbed walk what the joints' PD has added, see `BodyTicks.forget`.
    """

    def __init__(
        self, biped: Biped, initial: np.ndarray, tick: float, turns: bool = False, grip: Grip | None = None,
        uneven: bool = False, whole_body: WholeBodyConfig | None = None, ticks_per_step: int = 1,
        forgets: bool = False,
    ) -> None:  # fmt: skip
        super().__init__()
        self.parts = sizes(*_OUTPUTS)
        self._tick, self._grip = tick, grip
        self._ik = WholeBodyIk(biped)
        self._dynamics = InverseDynamics(biped, self._ik.task_space)
        self._joints = biped.q_index
        self.layer: BodyTicks | None = None
        if whole_body is not None and whole_body.kind != "closed_form" and grip is not None:
            clock, self.parts = Clock(tick, ticks_per_step), sizes("whole_body") | self.parts
            self.layer = BodyTicks(biped, self._ik.task_space, whole_body, grip, clock, initial)
        ports = [self.DeclareVectorInputPort(name, size(name)) for name in _INPUTS]
        phase, self._height, self._com, self._zmp, self._feet = ports
        self._phase = OptionalInput(phase)
        self._turn = self.DeclareVectorInputPort("turn_reference", size("turn_reference")) if turns else None
        self._ground = self.DeclareVectorInputPort("ground_reference", size("ground_reference")) if uneven else None
        ports += [port for port in (self._turn, self._ground) if port is not None]
        positions, self._velocities = len(initial), biped.plant.num_velocities()
        self._q = slice(positions)
        self._motion = slice(positions + 3 * self._velocities)  # in the state, in front of the torso's yaw
        self._yaw = slice(self._motion.stop, self._motion.stop + len(TorsoYaw()))
        own = np.zeros(0) if self.layer is None else self.layer.start
        self.start = np.concatenate([initial, np.zeros(self._yaw.stop - positions), own])
        self._applied = self.DeclareVectorInputPort("actuation", size("actuation")) if self.layer else None
        self.forgets = forgets and self.layer is not None
        status = "solver_status"
        self._status = self.DeclareVectorInputPort(status, size(status)) if self.forgets else None
        self.coming = slice(sum(self.parts.values()), None)  # state, behind the parts
        self.DeclareDiscreteState(self.start)
        self.DeclarePeriodicDiscreteUpdateEvent(tick, 0.0, self._update)
        prerequisites = {self.xd_ticket(), *(port.ticket() for port in ports)}
        self._size = self.coming.start + len(self.start)
        first = size("whole_body") if self.layer else 0
        self._own = slice(first, self.coming.start + self._yaw.start)  # what `write_motion` writes
        start = first + size("desired_state")
        self.feedforward = slice(start, start + size("feedforward"))
        self._solution = self.DeclareVectorOutputPort("solution", self._size, weakly(self._calc), prerequisites)

    def _update(self, context: Context, values: DiscreteValues) -> None:
        solution = self._solution.Eval(context)
        coming = solution[self.coming]
        if self._applied is not None:
            status = None if self._status is None else self._status.Eval(context)
            parts, applied = solution[: self.coming.start], self._applied.Eval(context)
            coming = self.learned(coming, self._phase(context), parts, applied, status)
        values.set_value(coming)

    def learned(
        self, state: np.ndarray, gait_phase: np.ndarray | None, parts: np.ndarray, applied: np.ndarray,
        status: np.ndarray | None = None,
    ) -> np.ndarray:  # fmt: skip
        """The state, with what the joints' PD added to the feedforward among the parts in the torques applied (12,).

        A layer that forgets has none of that where the plan of a solver_status (6,) is that of a disturbed walk.
        """
        state = state.copy()
        if self.forgets and self.layer is not None and status is not None and is_disturbed(status):
            self.layer.forget(state[self._yaw.stop :])
        elif self.layer is not None:
            self.layer.learn(state[self._yaw.stop :], gait_phase, applied, parts[self.feedforward])
        return state

    def _calc(self, context: Context, output: BasicVector) -> None:
        state = context.get_discrete_state_vector().value()
        turn, ground = (None if port is None else port.Eval(context) for port in (self._turn, self._ground))
        height, com = self._height.Eval(context), self._com.Eval(context)
        zmp, feet = self._zmp.Eval(context), self._feet.Eval(context)
        output.SetFromVector(self.solution(state, self._phase(context), height, com, zmp, feet, turn, ground))

    def solution(
        self, state: np.ndarray, gait_phase: np.ndarray | None, height: np.ndarray, com: np.ndarray, zmp: np.ndarray,
        feet: np.ndarray, turn: np.ndarray | None, ground: np.ndarray | None = None,
    ) -> np.ndarray:  # fmt: skip
        """The parts and the state to come, from the state and com_height, com_reference, zmp_reference and so on.

        `gait_phase` determines the swing foot, the one to miss its target; None where both feet stand. `turn` and
        `ground` are turn_reference and ground_reference, None on a walk without them.
        """
        swing = None if gait_phase is None else _SWING_FOOT.get(gait_phase[_SUPPORT])
        motion, yaw = state[self._motion], TorsoYaw(*state[self._yaw].tolist())
        last, step, wanted = motion[self._q], np.empty(self._velocities), np.zeros((3, self._velocities))
        write_step(motion, self._tick, step)
        write_wanted(com, height, feet, wanted)
        seed = self._ik.task_space.moved(last, step)
        angles: tuple[float, ...] = LEVEL
        if turn is not None:
            ways = turn.reshape(3, 3)
            wanted[1:, _TURNS] = ways[:, 1:].T
            left_yaw, right_yaw, torso_yaw = ways[:, 0].tolist()
            angles = (0.0, 0.0, torso_yaw, 0.0, 0.0, left_yaw, 0.0, 0.0, right_yaw)
        if ground is not None:
            angles = _put_on_ground(wanted, ground, angles)
        turning = yaw.returning
        if yaw.angle or yaw.rate:
            angles = (0.0, 0.0, angles[2] + yaw.angle, *angles[3:])
            add_to(wanted, _TURNS[2], yaw, turning)
        # A foot in the air carries nothing; with both on the ground the ZMP determines their shares of the load.
        left, right = wanted[0, LEFT], wanted[0, RIGHT]
        if ground is not None:
            left, right = _over_zmp(left, ground), _over_zmp(right, ground)
            share = _share(left, right, zmp[_ZMP], ground)
        else:
            share = left_share(left, right, zmp[_ZMP])
        now = None
        if self.layer is not None:
            now = self.layer.now(state[self._yaw.stop :], gait_phase, share, swing)
            angles = self.layer.add_to(now, wanted, angles)
        (q, v, vdot, found), torque = self._dynamics.along(self._ik, wanted, seed, share, swing, angles)
        if self._grip is not None:
            used = use_of_ground(torque.left, left, torque.right, right)
            yielding = yaw.yielding(self._grip, turning, *used)
            if yielding != turning and found.ok:
                wanted[2, _TURNS[2]] += yielding - turning
                v, vdot = self._ik.derivatives(q, wanted[1], wanted[2])
                torque, turning = self._dynamics(q, v, vdot, share), yielding
        solution = np.empty(self._size)
        if self.layer is not None and now is not None:
            said, memory = solution[: self._own.start], solution[self._own.stop + len(yaw) :]
            q, vdot, torque = self.layer.end(now, last, q, (v, vdot), torque, found.ok, said, memory)
        reached = zmp_of_wrenches(torque.left, left, torque.right, right)
        status, out = (found.ok, min(found.error, _LARGEST_ERROR), found.iterations), solution[self._own]
        write_motion(q, v, vdot, motion, self._joints, self._tick, torque.tau, reached, status, out)
        start = self.coming.start
        solution[start + self._yaw.start], solution[start + self._yaw.stop - 1] = yaw.after(turning, self._tick)
        return solution


def _put_on_ground(wanted: np.ndarray, ground: np.ndarray, angles: tuple[float, ...]) -> tuple[float, ...]:
    """Adds the line under the CoM and the rates of the soles' tilt to `wanted`; returns the angles with that tilt."""
    wanted[:, COM.start + 2] += ground[:3]
    found = list(angles)
    for index, (place, turn) in enumerate(zip(_TILTS, (LEFT_TURN, RIGHT_TURN), strict=True)):
        roll, pitch = ground[place].reshape(2, 3)
        found[3 + 3 * index : 5 + 3 * index] = float(roll[0]), float(pitch[0])
        c, s = math.cos(angles[5 + 3 * index]), math.sin(angles[5 + 3 * index])
        wanted[1:, turn.start] += c * roll[1:] - s * pitch[1:]
        wanted[1:, turn.start + 1] += s * roll[1:] + c * pitch[1:]
    return tuple(found)


def _over_zmp(sole: np.ndarray, ground: np.ndarray) -> np.ndarray:
    """A sole's centre (3,), its height counted from that of the ZMP [m]."""
    return np.array([sole[0], sole[1], sole[2] - ground[_Z_ZMP]])


def _share(left: np.ndarray, right: np.ndarray, zmp: np.ndarray, ground: np.ndarray) -> float:
    """As `kernels.left_share`, by which of the soles is in the air."""
    in_air = ground[_ALOFT].tolist()
    return 0.0 if in_air[0] else 1.0 if in_air[1] else left_share_of_zmp(zmp, left, right)
