"""Which feet carry load, from measured forces: hysteresis and hold."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.estimation.config import EstimatorConfig
from pdhocbf_drake.estimation.memory import Memory
from pdhocbf_drake.estimation.sample import Notice

_FORGOTTEN = 0.9  # of the number of changes, a tick
_FLICKERS = 3.0  # more changes of a foot's load than this, within some ten ticks, are no steps


def notice_contacts(
    memory: Memory, config: EstimatorConfig, weight: float, trusted: np.ndarray, support: float | None
) -> Notice:
    """Moves `loaded` and `above` on to this tick.

    A foot is loaded when it has carried `load_on` of the weight for `hold_ticks` in a row, until it carries less than
    `load_off`. Where a force can't be trusted, or comes and goes, the foot that is to stand is.

    Args:
        trusted: whether each foot's force is (2,).
        support: the foot that is to stand, see `Sample`.
    """
    notice = Notice.NONE
    planned = np.array([support is None or support >= 0.0, support is None or support <= 0.0], dtype=float)
    for side in (0, 1):
        share = memory.force_torque[6 * side + 5] / weight
        before = memory.above[side]
        level = config.load_off if before or memory.loaded[side] else config.load_on
        memory.above[side] = before + 1.0 if share >= level else 0.0
        memory.changes[side] = _FORGOTTEN * memory.changes[side] + ((memory.above[side] > 0.0) != (before > 0.0))
        loaded = float(memory.above[side] >= config.hold_ticks)
        if trusted[side] and memory.changes[side] > _FLICKERS:
            notice |= Notice.FLICKER
            loaded = planned[side]
        elif not trusted[side]:
            notice |= Notice.FORCE_TORQUE
            loaded = planned[side]
        memory.loaded[side] = loaded
    return notice
