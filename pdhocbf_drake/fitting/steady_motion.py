"""A steady walk of all links without a simulation: what the plan of the template asks of joints, soles and ground."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.loop import Measurement, TemplateTick
from pdhocbf_drake.mpc.orbit import settled_gait
from pdhocbf_drake.robot import Biped, InverseDynamics, WholeBodyIk, zmp_of_wrenches
from pdhocbf_drake.robot.ik import LEVEL
from pdhocbf_drake.robot.kernels import left_share, use_of_ground
from pdhocbf_drake.robot.posture import LEFT, RIGHT, TargetPoses
from pdhocbf_drake.systems.kernels import write_wanted
from pdhocbf_drake.systems.signals import places
from pdhocbf_drake.walking.swing import Swing

_PASSES = 2  # the first one has no ZMP offset yet; a third one changes torques by less than 1 %
_CLOSE = 1e-6  # [m/s], see `settled_gait`
_ZMP = places("zmp_reference", "x_zmp", "y_zmp")


class SteadyMotion(NamedTuple):
    """One gait in the steady state, T = 2N ticks; joints in the order of `systems.signals.JOINTS`.

    Attributes:
        torques: inverse-dynamics torques (T, 12) [N m].
        speeds: joint speeds, not limited (T, 12) [rad/s].
        zmp: ZMP of all links (T, 2) [m].
        offsets: that less the ZMP of the template (T, 2) [m].
        box: the ZMP box (27) at each tick (T, 2, 2) [m].
        friction: horizontal over vertical force on both soles together (T,) [1].
        yaw_moment: moment about the vertical through the ZMP over the vertical force, with its sign (T,) [m].
    """

    torques: np.ndarray
    speeds: np.ndarray
    zmp: np.ndarray
    offsets: np.ndarray
    box: np.ndarray
    friction: np.ndarray
    yaw_moment: np.ndarray

    @property
    def zmp_inside(self) -> float:
        """Least distance of the ZMP from the edge of its box, negative outside [m]."""
        return float(np.minimum(self.zmp - self.box[..., 0], self.box[..., 1] - self.zmp).min())


class OutOfReach(NamedTuple):
    """Why a posture of the walk can't be taken."""

    reason: str


def steady_motion(biped: Biped, mpc: PeriodicMpc) -> SteadyMotion | OutOfReach:
    """The motion of all links on the settled orbit of the template under the periodic MPC.

    The orbit is that under the ZMP offset of the motion itself, which the controller learns as it walks.

    Args:
        mpc: of a walk straight ahead without barriers and without an end.

    Raises:
        InputError: the walk can't be planned, or doesn't settle, see `mpc.orbit.settled_gait`.
    """
    cycle, horizon = mpc.gait.config.ticks_per_gait, mpc.config.horizon
    offsets = np.zeros((cycle, 2))

    def expecting(measured: Measurement) -> Measurement:
        coming = (measured.tick + 1 + np.arange(horizon)) % cycle
        return measured._replace(zmp_offset=offsets[coming].T)

    motion: SteadyMotion | OutOfReach = OutOfReach("")
    for _ in range(_PASSES):
        motion = _motion(biped, mpc, settled_gait(mpc.gait, mpc, _CLOSE, expecting))
        if isinstance(motion, OutOfReach):
            return motion
        offsets = motion.offsets
    return motion


def _motion(biped: Biped, mpc: PeriodicMpc, ticks: list[TemplateTick]) -> SteadyMotion | OutOfReach:
    gait = mpc.gait
    ik, swing, q = WholeBodyIk(biped), Swing(gait), biped.bent_knee
    task = ik.task_space
    dynamics = InverseDynamics(biped, task)
    rows: list[tuple[np.ndarray | float, ...]] = []
    feet = np.zeros(18)
    for tick in ticks:
        step, phase = gait.phase(tick.tick)
        before, wanted = tick.before, np.zeros((3, 18))
        feet = swing.feet(phase, gait.support(step), before.foot_plan, feet, gait.lift_off(step))
        write_wanted(before.com_reference, np.array(gait.height(tick.tick)), feet, wanted)
        level = TargetPoses(wanted[0], *LEVEL)
        found = ik.solve_poses(level, q)
        if not found.ok:
            return OutOfReach(found.reason)
        q = found.q
        task.set_positions(q)
        v = task.solve(wanted[1])
        if v is None:
            return OutOfReach("a leg is straight")
        task.set_state(q, v)
        vdot = task.solve(wanted[2] - task.bias())
        assert vdot is not None
        left, right, planned = wanted[0, LEFT], wanted[0, RIGHT], before.zmp_reference[_ZMP]
        forces = dynamics(q, v, vdot, left_share(left, right, planned))
        zmp = np.array(zmp_of_wrenches(forces.left, left, forces.right, right))
        friction, moment = use_of_ground(forces.left, left, forces.right, right)
        rows.append((forces.tau, v[biped.v_index], zmp, zmp - planned, before.zmp_box.reshape(2, 2), friction, moment))
    return SteadyMotion(*(np.array(column) for column in zip(*rows, strict=True)))
