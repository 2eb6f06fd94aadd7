"""The nominal periodic orbit of the template under the periodic MPC without barriers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import islice

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.loop import Measurement, TemplateTick, walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.frame import rotation
from pdhocbf_drake.walking.sides import LEFT

_RECURRENCE = 1e-9  # [m/s]
_CLOSE = 1e-6  # likewise, of one of many walks [m/s]
_NOISE = 1e-5  # of an interior-point solver [m/s]
_GAITS = 500
_PATIENCE = 20  # gaits in which the change must become less than ever before


def nominal_walk(gait: Gait, mpc: PeriodicMpc) -> np.ndarray:
    """c, v, p over one gait in the steady state of the walk, c and p from the stance foot, shape (2, 2N, 3).

    Raises:
        InputError: as `settled_gait`.
    """
    return _from_stance(gait, settled_gait(gait, mpc))


def commanded_orbit(gait: Gait, mpc: PeriodicMpc) -> np.ndarray:
    """c, v, p over a step on the left and one on the right foot in the steady state of a walk under one command.

    c and p are from the stance foot, all along its heading, shape (2 feet, 2 axes, N, 3).

    Raises:
        InputError: as `settled_gait`.
    """
    ticks = settled_gait(gait, mpc, _CLOSE)
    steps = np.split(_from_stance(gait, ticks), 2, axis=1)
    return np.stack(steps if gait.support(ticks[0].tick // gait.period) == LEFT else steps[::-1])


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
        _check_planned(mpc, tick)
    before, changes = np.full((2, cycle, 3), np.inf), [np.inf]
    while len(changes) <= _GAITS:
        ticks = []
        for tick in islice(walk, cycle):
            _check_planned(mpc, tick)
            ticks.append(tick)
        states = _from_stance(gait, ticks)
        change, last = np.abs(states - before)[:, :, 1].max(), changes[-1]
        # A change that shrinks by the factor r from gait to gait leaves r/(1 − r) of itself to come. A solver that is
        # less exact comes to its own noise, from which nothing shrinks any more.
        to_come = change**2 / (last - change) if change < last < np.inf else change
        if to_come < recurrence or last <= change < _NOISE:
            return ticks
        before = states
        changes.append(change)
        if len(changes) > _PATIENCE and min(changes[-_PATIENCE:]) >= min(changes[:-_PATIENCE]):
            break
    raise _unsettled(mpc, changes)


def _unsettled(mpc: PeriodicMpc, changes: Sequence[float]) -> InputError:
    """The error of a walk whose velocity changes so from gait to gait [m/s]."""
    gait, config = mpc.gait.config, mpc.config
    text = (
        f"gait: the walk does not settle into a periodic orbit: after {len(changes) - 1} gaits of "
        f"{gait.ticks_per_gait * gait.tick:g} s its velocity still changes by {changes[-1]:.2g} m/s"
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


def _check_planned(mpc: PeriodicMpc, tick: TemplateTick) -> None:
    if tick.plan.fallbacks:
        gait, config = mpc.gait.config, mpc.config
        raise InputError(
            f"gait: the walk can't be planned ({tick.plan.reason.name.lower()} at tick {tick.tick}): gait.stride "
            f"{gait.stride:g} m or gait.stance_width {gait.stance_width:g} m is too much for a step of "
            f"{gait.ticks_per_step * gait.tick:g} s, or mpc.zmp_margin {config.zmp_margin:g} m and mpc.step_tolerance "
            f"{list(config.step_tolerance)} m leave too little"
        )
