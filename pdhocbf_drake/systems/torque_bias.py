"""The torque that a leg on the ground needs and the model lacks, learned from what the joints' PD adds."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from pdhocbf_drake.robot.config import SIDES
from pdhocbf_drake.robot.per_joint import ROLES
from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.systems.disturbed import is_disturbed
from pdhocbf_drake.systems.kernels import learn_bias, write_sent_torque
from pdhocbf_drake.systems.signals import size, sizes
from pdhocbf_drake.walking.gait import Gait

_INPUTS = "gait_phase", "solver_status", "feedforward", "actuation"
_LEARNED = tuple(place for place, role in enumerate(ROLES) if role in ("hip_roll", "hip_pitch", "knee_pitch"))
_GAIN = 0.02  # share of an error by which the bias moves in a tick [1]
_BAND, _ERROR = 0.01, 0.04  # bias below which nothing is added, largest error of a tick; over weight times CoM height
_FROM, _TO = 0.15, 0.85  # of a step: before and after it the load changes feet
_SHIFT = 0.1  # of a step, in which what is added moves to the other leg


class TorqueBias(Block):
    """Adds to the feedforward what the PD of the leg that stands has been found to add to it on average.

    A torso that is heavier than the model's, or a CoM that is elsewhere, is held by the joints' PD alone: hip and knee
    give way until their errors make the missing torque, the robot sinks and leans, and its swing foot touches the
    ground early. At hip roll, hip pitch and knee of the leg that stands,

        b ← b + g (τ_applied − τ_feedforward − b)
        τ_sent = τ_feedforward + s f b,    f = clip(|b|/band − 1, 0, 1)

    where s is the leg's share of the load, the bias b is the vector of the leg's three joints, and a tick's error is no
    longer than a bound. The gait itself, on an exact model, makes |b| half of `band`: nothing is added to it. While a
    disturbed walk is recovered nothing is learned. The ankles are left out: their torque is the ZMP, whose error is
    what `mpc.cancelling` takes off, and two estimates of one thing would drift against each other. No joint is sent
    more torque than it has, unless the feedforward itself asks for more.

    Input ports:
        gait_phase (3), solver_status (6), feedforward (12), actuation (12): as in `systems.signals`.
    Output parts, see `unbundled`:
        torque_bias (12): what is added, s f b [N m].
        sent_torque (12): the feedforward with it [N m].

    Attributes:
        start: the memory at the start: b of the left, then the right leg, each in the order of `ROLES`; s of the left.

    Args:
        gait: the walk.
        weight: of the model [N].
        limits: torques that the joints have (12,) [N m].
    """

    def __init__(self, gait: Gait, weight: float, limits: np.ndarray) -> None:
        super().__init__()
        self.parts = sizes("torque_bias", "sent_torque")
        self._period, self._moment = gait.period, weight * gait.config.com_height
        self._learned, self._limits = np.array(_LEARNED), limits
        self.start = np.append(np.zeros(len(SIDES) * len(ROLES)), 0.5)
        ports = [self.DeclareVectorInputPort(name, size(name)) for name in _INPUTS]
        self._phase, self._status, self._feedforward, self._applied = ports
        self.DeclareDiscreteState(self.start)
        self.DeclarePeriodicDiscreteUpdateEvent(gait.config.tick, 0.0, self._update)
        prerequisites = {self.xd_ticket(), self._feedforward.ticket()}
        self.DeclareVectorOutputPort("torques", sum(self.parts.values()), weakly(self._calc), prerequisites)

    def _update(self, context: Context, values: DiscreteValues) -> None:
        ports = self._phase, self._status, self._feedforward, self._applied
        memory = context.get_discrete_state_vector().value()
        values.set_value(self.learned(memory, *(port.Eval(context) for port in ports)))

    def _calc(self, context: Context, output: BasicVector) -> None:
        memory = context.get_discrete_state_vector().value()
        output.SetFromVector(self.torques(memory, self._feedforward.Eval(context)))

    def learned(
        self, memory: np.ndarray, gait_phase: np.ndarray, status: np.ndarray, feedforward: np.ndarray,
        applied: np.ndarray,
    ) -> np.ndarray:  # fmt: skip
        """The memory for tick k + 1, from gait_phase, solver_status, feedforward and actuation at tick k.

        Torques that are not finite teach nothing.
        """
        memory, (tick, _, support) = memory.copy(), gait_phase.tolist()
        stands = support and _FROM <= tick / self._period <= _TO and not is_disturbed(status)
        leg = (0 if support > 0.0 else 1) if stands else -1
        share, most = 0.5 * (1.0 + support), 1.0 / (_SHIFT * self._period)
        learn_bias(memory, self._learned, leg, applied, feedforward, _GAIN, _ERROR * self._moment, (share, most))
        return memory

    def torques(self, memory: np.ndarray, feedforward: np.ndarray) -> np.ndarray:
        """torque_bias and sent_torque of a tick (24,), from the memory for it."""
        out = np.empty(2 * len(feedforward))
        write_sent_torque(memory, feedforward, _BAND * self._moment, self._limits, out)
        return out
