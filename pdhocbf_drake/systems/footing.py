"""Feet that meet the ground earlier or later than planned, or at another tilt."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.systems.footing_kernels import FOOT, LATE, SIZE, STANDS, STATE, feel, put_where_met
from pdhocbf_drake.systems.gait_reference import changed_gait
from pdhocbf_drake.systems.optional_input import OptionalInput
from pdhocbf_drake.systems.signals import size, sizes
from pdhocbf_drake.walking import Gait


class Footing(Block):
    """Takes the ground for where the soles meet it: the planned motion of the soles, moved to where they are felt.

    A swing foot that carries load in the second half of its swing stops there, and stands in the next step. A foot
    that is to carry load, and does not, goes on down at a bounded speed until it does, and counts as in the air so
    long; the other foot waits on the ground, with the ZMP under it, and then catches up with its swing. The target of a
    sole that carries load follows the sole as it is measured, its height and its tilt: a foot gives way to the ground,
    while the posture above it is held in the world. Where the next foot lands, the ground is taken to be off the plan
    by as much as under the stance foot; a swinging sole turns back to its planned tilt. The CoM's line follows the
    height of the stance foot.

    All this is added to the plan, be that for level ground or for what is on the map.

    Input ports:
        gait_phase (3), foot_reference (18), resumed (3): as in `systems.signals`.
        ground_reference (18): likewise, of a walk that is planned on uneven ground.
        foot_state (12), foot_load (2): as measured.
    Output parts, see `unbundled`:
        foot_target (18), ground_target (18), landing_delay (1): as in `systems.signals`.

    Args:
        gait: the walk.
        limits: load from which a foot carries, and from which one that swings has met the ground [N].
        delay: of what is measured [ticks].

    Attributes:
        start: the memory at the start, see `footing_kernels`.
    """

    def __init__(self, gait: Gait, limits: tuple[float, float], delay: int) -> None:
        super().__init__()
        self._gait, self._limits = gait, limits
        self._timing = gait.period, gait.config.tick, delay
        self.parts = sizes("foot_target", "ground_target", "landing_delay")
        self.start = np.zeros(SIZE)
        self.start[[STATE, FOOT + STATE]] = STANDS
        names = ("gait_phase", "foot_reference", *["ground_reference"] * gait.uneven)
        ports = [self.DeclareVectorInputPort(name, size(name)) for name in names]
        self._phase, self._feet = ports[:2]
        self._ground = ports[2] if gait.uneven else None
        resumed = self.DeclareVectorInputPort("resumed", size("resumed"))
        self._resumed = OptionalInput(resumed)
        self._measured, self._loads = (
            self.DeclareVectorInputPort(name, size(name)) for name in ("foot_state", "foot_load")
        )
        self.DeclareDiscreteState(self.start)
        self.DeclarePeriodicDiscreteUpdateEvent(gait.config.tick, 0.0, self._update)
        prerequisites = {self.xd_ticket(), resumed.ticket(), *(port.ticket() for port in ports)}
        self.DeclareVectorOutputPort("targets", sum(self.parts.values()), weakly(self._calc), prerequisites)

    def _update(self, context: Context, values: DiscreteValues) -> None:
        memory = context.get_discrete_state_vector().value()
        measured, loads = self._measured.Eval(context), self._loads.Eval(context)
        values.set_value(self.felt(memory, *self._planned(context), measured, loads))

    def _calc(self, context: Context, output: BasicVector) -> None:
        memory = context.get_discrete_state_vector().value()
        output.SetFromVector(np.concatenate(self.targets(memory, *self._planned(context))))

    def _planned(self, context: Context) -> tuple[np.ndarray, np.ndarray, np.ndarray | None, Gait]:
        ground = None if self._ground is None else self._ground.Eval(context)
        gait = changed_gait(self._gait, None, self._resumed(context), None)
        return self._phase.Eval(context), self._feet.Eval(context), ground, gait

    def felt(
        self, memory: np.ndarray, gait_phase: np.ndarray, feet: np.ndarray, ground: np.ndarray | None, gait: Gait,
        measured: np.ndarray, loads: np.ndarray,
    ) -> np.ndarray:  # fmt: skip
        """The memory for tick k + 1, from what is planned and measured at tick k; of the gait, its lift-off counts.

        What is not finite is not felt.
        """
        tick, step, support = gait_phase.tolist()
        memory, ground = memory.copy(), _level() if ground is None else ground
        lift_off = gait.lift_off(round(step))
        feel(memory, self._timing, tick, support, lift_off, feet, ground, measured, loads, self._limits)
        return memory

    def targets(
        self, memory: np.ndarray, gait_phase: np.ndarray, feet: np.ndarray, ground: np.ndarray | None, gait: Gait
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """foot_target, ground_target and landing_delay of a tick, from the memory for it and what is planned."""
        tick, step, support = gait_phase.tolist()
        feet, ground = feet.copy(), _level() if ground is None else ground.copy()
        put_where_met(memory, self._timing, tick, support, gait.lift_off(round(step)), feet, ground)
        return feet, ground, memory[[LATE]]


def _level() -> np.ndarray:
    """ground_reference of level ground, but for which soles are in the air."""
    return np.zeros(size("ground_reference"))
