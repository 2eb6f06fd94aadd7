"""The nominal periodic orbit of the template under the periodic MPC without barriers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import islice

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.loop import Measurement, TemplateTick, walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.plan import Plan
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.frame import rotation

_RECURRENCE = 1e-9  # [m/s]
_NOISE = 1e-5  # of an interior-point solver [m, m/s]
_GAITS = 500
_PATIENCE = 20  # gaits in which the change must become less than ever before


def nominal_walk(gait: Gait, mpc: PeriodicMpc) -> np.ndarray:
    """c, v, p over one gait in the steady state of the walk, c and p from the stance foot, shape (2, 2N, 3).

    Raises:
        InputError: as `settled_gait`.
    """
    return _from_stance(gait, settled_gait(gait, mpc))


def settled_gait(
    gait: Gait,
    mpc: PeriodicMpc,
    recurrence: float = _RECURRENCE,
    sensor: Callable[[Measurement], Measurement] | None = None,
) -> list[TemplateTick]:
    """The ticks of one gait of the undisturbed template in its steady state, from an even step on.

    Walks the template from its standing start until a gait repeats the one before, each step seen along the heading of
    its foot, to within `recurrence` [m/s]. The `sensor` is that of `walk_template`, with a period of a gait.

    Raises:
        InputError: the walk has barriers or an end, or doesn't settle.
    """
    if any(mpc.barriers) or gait.has_end:
        raise InputError("the nominal orbit is that of a walk without barriers and without an end")
    cycle = gait.config.ticks_per_gait
    start = gait.config.start_steps * gait.period
    start += start % cycle
    walk = walk_template(mpc, Memory.standing(mpc), 0, start + _GAITS * cycle, sensor=sensor)
    for tick in islice(walk, start):
        check_planned(mpc, tick.tick, tick.plan)
    before, changes = np.full((2, cycle, 3), np.inf), Recurrence(mpc, recurrence, "m/s")
    while True:
        ticks = []
        for tick in islice(walk, cycle):
            check_planned(mpc, tick.tick, tick.plan)
            ticks.append(tick)
        states = _from_stance(gait, ticks)
        change = float(np.abs(states - before)[:, :, 1].max())
        if changes.reached(change, changes.to_come(change)):
            return ticks
        before = states


class Recurrence:
    """Whether a walk has settled, by how much it changes from gait to gait.

    Args:
        mpc: of the walk.
        close: what may be left to come [unit].
        unit: m or m/s.
    """

    def __init__(self, mpc: PeriodicMpc, close: float, unit: str) -> None:
        self._mpc, self._close, self._unit, self._changes = mpc, close, unit, [np.inf]

    def to_come(self, change: float) -> float:
        """What is left to come after a gait with this change: r/(1 − r) of it, where it shrinks by r a gait."""
        last = self._changes[-1]
        return change**2 / (last - change) if change < last < np.inf else change

    def reached(self, change: float, left: float) -> bool:
        """Whether it has, after a gait with this change, where so much is left; raises `InputError` if it never will.

        A solver that is less exact comes to its own noise, from which nothing shrinks any more.
        """
        changes = self._changes
        if left < self._close or changes[-1] <= change < _NOISE:
            return True
        changes.append(change)
        stays = len(changes) > _PATIENCE and min(changes[-_PATIENCE:]) >= min(changes[:-_PATIENCE])
        if stays or len(changes) > _GAITS:
            raise _unsettled(self._mpc, changes, self._unit)
        return False


def _unsettled(mpc: PeriodicMpc, changes: Sequence[float], unit: str) -> InputError:
    """The error of a walk that changes so from gait to gait."""
    gait, config = mpc.gait.config, mpc.config
    what = "velocity" if unit == "m/s" else "ZMP"
    text = (
        f"gait: the walk does not settle into a periodic orbit: after {len(changes) - 1} gaits of "
        f"{gait.ticks_per_gait * gait.tick:g} s its {what} still changes by {changes[-1]:.2g} {unit}"
    )
    if len(changes) <= _GAITS:  # it goes to and fro, since what is planned late in a step can't be put right
        return InputError(
            f"{text}, and no less than before; what settles are longer steps (gait.ticks_per_step "
            f"{gait.ticks_per_step}, gait.tick {gait.tick:g} s) or less mpc.freeze_ticks ({config.freeze_ticks})"
        )
    return InputError(
        f"{text}, which shrinks too slowly; a larger mpc.foothold_weight ({config.foothold_weight:g}) or a smaller "
        f"mpc.zmp_centre_weight ({config.zmp_centre_weight:g}) settles sooner"
    )


def _from_stance(gait: Gait, ticks: Sequence[TemplateTick]) -> np.ndarray:
    """c, v, p of each tick, c and p from the stance foot, all along its heading, shape (2, T, 3)."""
    states = np.stack([tick.state - tick.before.stance[:, 1:] * [1.0, 0.0, 1.0] for tick in ticks], axis=1)
    if gait.turns:
        seen = [rotation(-gait.step(tick.tick // gait.period).yaw) for tick in ticks]
        states = np.einsum("tij,jtk->itk", seen, states)
    return states


def check_planned(mpc: PeriodicMpc, tick: int, plan: Plan) -> None:
    """Raises `InputError` where the plan of tick k is no plan."""
    if plan.fallbacks:
        gait, config = mpc.gait.config, mpc.config
        raise InputError(
            f"gait: the walk can't be planned ({plan.reason.name.lower()} at tick {tick}): gait.stride "
            f"{gait.stride:g} m or gait.stance_width {gait.stance_width:g} m is too much for a step of "
            f"{gait.ticks_per_step * gait.tick:g} s, or mpc.zmp_margin {config.zmp_margin:g} m and mpc.step_tolerance "
            f"{list(config.step_tolerance)} m leave too little"
        )
