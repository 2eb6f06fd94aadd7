"""Random courses of stepping blocks that are on the map."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from pdhocbf_drake.studies.ground.known import fitted
from pdhocbf_drake.studies.ground.measures import clean
from pdhocbf_drake.studies.shared.checks import Outcome
from pdhocbf_drake.studies.shared.row_kinds import Asked
from pdhocbf_drake.studies.shared.work import Work, fallen, walked

ROW: Final = "blocks"
_BLOCKS, _QUICK_BLOCKS = 12, 4
_FIRST, _APART = 0.6, 0.2  # x of the first block, and usual distance to the next [m]
_HEIGHT, _LENGTH = 0.04, 0.2  # largest height [m], and share of the distance
_SIZE = 0.24, 0.15  # of a block [m]


def plan(row: str, asked: Asked) -> list[Work]:
    """A walk over each course."""
    blocks = _QUICK_BLOCKS if asked.quick else _BLOCKS
    setting, walks = {"seed": asked.numbers["seed"], "blocks": blocks}, range(asked.numbers["walks"])
    return [Work(row, asked.scenario, {**setting, "draw": draw}) for draw in walks]


def course(seed: int, draw: int, blocks: int, width: float) -> list[list[float]]:
    """x, y and height of the blocks, on the feet's sides in turn, the first one on the left [m]."""
    random = np.random.default_rng([seed, draw])
    ways = _APART * (1.0 + random.uniform(-_LENGTH, _LENGTH, blocks))
    x, z = _FIRST + np.cumsum(ways) - ways[0], random.uniform(-_HEIGHT, _HEIGHT, blocks)
    y = 0.5 * width * (-1.0) ** np.arange(blocks)
    return np.column_stack([x, y, z]).round(4).tolist()


def measure(work: Work) -> Outcome:
    """Walks over one course."""
    asked: dict[str, Any] = dict(work.setting)
    scenario = work.with_keys(barriers={})
    found = course(asked["seed"], asked["draw"], asked["blocks"], scenario.gait.stance_width)
    scenario = fitted(work.with_keys(barriers={}, ground=[{"kind": "blocks", "footsteps": found, "size": _SIZE}]))
    log, metrics = walked(scenario)
    return Outcome(
        clean(ROW, scenario, log, metrics), fallen(f"course {asked['draw']} of seed {asked['seed']}", metrics)
    )
