"""The points of a campaign's sample: a grid, or draws that do not depend on how many there are."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from pdhocbf_drake.studies.campaign.config import CampaignConfig, FactorConfig


class Point(NamedTuple):
    """A value for each factor, and the seed of the runs there."""

    values: dict[str, Any]
    seed: int


def points(config: CampaignConfig) -> Iterator[Point]:
    """The sample's points in order; draw i is the same however many follow, so that a sample can be made larger."""
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
