"""The factors of a campaign: their values at each point of the sample, and the fields of a scenario that they set."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.studies.campaign.config import CampaignConfig, FactorConfig


class Point(NamedTuple):
    """A value for each factor, and the seed of the runs there."""

    values: dict[str, Any]
    seed: int


def points(config: CampaignConfig) -> Iterator[Point]:
    """The sample's points in order: a grid, or draws. Draw i does not depend on how many follow: a sample can grow."""
    if config.sample == "random":
        for draw in range(math.ceil((config.runs or 0) / len(config.barriers))):
            generator = np.random.default_rng([config.seed, draw])
            seed = int(generator.integers(2**31))
            yield Point({path: _drawn(factor, generator) for path, factor in config.factors.items()}, seed)
        return
    axes = [_spaced(factor) for factor in config.factors.values()]
    for index, (_, *values) in enumerate(itertools.product(range(config.repeats), *axes)):
        seed = int(np.random.default_rng([config.seed, index]).integers(2**31))
        yield Point(dict(zip(config.factors, values, strict=True)), seed)


def _drawn(factor: FactorConfig, generator: np.random.Generator) -> Any:
    if factor.values is not None:
        return factor.values[int(generator.integers(len(factor.values)))]
    low, high = _ends(factor)
    if factor.scale == "log":
        value = math.exp(generator.uniform(math.log(low), math.log(high)))
        return round(value) if factor.integer else value
    return int(generator.integers(int(low), int(high) + 1)) if factor.integer else float(generator.uniform(low, high))


def _spaced(factor: FactorConfig) -> list[Any]:
    if factor.values is not None:
        return list(factor.values)
    low, high = _ends(factor)
    make = np.geomspace if factor.scale == "log" else np.linspace
    values = [float(value) for value in make(low, high, factor.points or 2)]
    return list(dict.fromkeys(round(value) for value in values)) if factor.integer else values


def _ends(factor: FactorConfig) -> tuple[float, float]:
    if factor.low is None or factor.high is None:
        raise ValueError("a factor has either values, or low and high")
    return factor.low, factor.high


def has_field(data: Any, path: str) -> bool:
    """Whether the field with that dotted path exists, such as "gait.stride", "pushes.0.force.1"."""
    try:
        set_field(data, path, None)
    except InputError:
        return False
    return True


def set_field(data: Any, path: str, value: Any) -> Any:
    """A copy of plain `data` with the field at a dotted path replaced.

    Raises:
        InputError: there is no such field; the message lists those that exist.
    """
    return _replaced(data, path.split("."), value, path, "")


def _replaced(data: Any, rest: list[str], value: Any, path: str, done: str) -> Any:
    if not rest:
        return value
    here, below = rest[0], rest[1:]
    where = f"{done}.{here}" if done else here
    if isinstance(data, dict):
        if here not in data:
            raise InputError(f"factor '{path}': no field '{here}'{_inside(done)}; there are {_listed(data)}")
        return {**data, here: _replaced(data[here], below, value, path, where)}
    if isinstance(data, list):
        if not here.isdecimal() or int(here) >= len(data):
            there = f"numbers 0 to {len(data) - 1}" if data else "none, since the list is empty"
            raise InputError(f"factor '{path}': no entry '{here}'{_inside(done)}; there are {there}")
        index = int(here)
        return [*data[:index], _replaced(data[index], below, value, path, where), *data[index + 1 :]]
    raise InputError(f"factor '{path}': '{done}' is a plain value ({data!r}) with no field '{here}'")


def _inside(done: str) -> str:
    return f" in '{done}'" if done else ""


def _listed(data: dict[str, Any]) -> str:
    return ", ".join(map(str, data)) or "none"
