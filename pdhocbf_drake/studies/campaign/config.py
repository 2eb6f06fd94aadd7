"""The configuration of a campaign: its scenario, the factors that vary and their sample, the barriers to compare."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Any, Final, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from pdhocbf_drake.config import Config
from pdhocbf_drake.studies.shared.command_sequences import CommandSequence, drawing

MOST_RUNS: Final = 100_000  # all of them are checked, and held in memory, before the first one starts


class FactorConfig(Config):
    """How one field of the scenario varies: over given values, between two ends, or as commands drawn in a row.

    Attributes:
        values: values of the field, in its unit; any YAML that a scenario accepts there.
        low, high: the ends, both included, in the field's unit.
        points: on a grid, the number of values from low to high.
        integer: whole numbers only.
        scale: "log" spaces (or draws) evenly in the logarithm.
        sequence: for the field `commands` of a random sample: how each command is drawn.
        unit: written on the axes of the report.
    """

    values: tuple[Any, ...] | None = Field(None, min_length=1)
    low: float | None = None
    high: float | None = None
    points: int | None = Field(None, ge=2)
    integer: bool = False
    scale: Literal["linear", "log"] = "linear"
    sequence: CommandSequence | None = None
    unit: str = "1"

    @model_validator(mode="after")
    def _one_kind(self) -> FactorConfig:
        ends = (self.low is not None, self.high is not None)
        if [self.values is not None, all(ends), self.sequence is not None].count(True) != 1 or ends[0] != ends[1]:
            raise ValueError("a factor has either values, or low and high, or a sequence")
        if self.low is None or self.high is None:
            if self.points is not None or self.integer or self.scale != "linear":
                raise ValueError("points, integer and scale belong to low and high, not to values or a sequence")
            return self
        if self.low >= self.high:
            raise ValueError(f"low must be below high, given {self.low:g} and {self.high:g}")
        if self.scale == "log" and self.low <= 0:
            raise ValueError(f"a logarithmic scale needs low above 0, given {self.low:g}")
        if self.integer and (self.low % 1 or self.high % 1):
            raise ValueError(f"whole numbers need whole ends, given {self.low:g} and {self.high:g}")
        return self

    def drawn(self, generator: np.random.Generator) -> Any:
        """A random value."""
        if self.sequence is not None:
            return self.sequence.drawn(generator)
        if self.values is not None:
            return self.values[int(generator.integers(len(self.values)))]
        low, high = self._ends()
        if self.scale == "log":
            value = math.exp(generator.uniform(math.log(low), math.log(high)))
            return round(value) if self.integer else value
        return int(generator.integers(int(low), int(high) + 1)) if self.integer else float(generator.uniform(low, high))

    def spaced(self) -> list[Any]:
        """The values of a grid."""
        if self.values is not None:
            return list(self.values)
        make = np.geomspace if self.scale == "log" else np.linspace
        values = [float(value) for value in make(*self._ends(), self.points or 2)]
        return list(dict.fromkeys(round(value) for value in values)) if self.integer else values

    def _ends(self) -> tuple[float, float]:
        if self.low is None or self.high is None:
            raise ValueError("a factor has either values, or low and high")
        return self.low, self.high


class Point(NamedTuple):
    """A value for each factor, and the seed of the runs there."""

    values: dict[str, Any]
    seed: int


class CampaignConfig(Config):
    """A grid or a random sample over fields of a scenario.

    Every point of the sample is run once with each barrier, from the same seed, so that barriers are compared on
    the same pushes and the same noise.

    Attributes:
        description: one sentence for the report.
        scenario: a name from `pdhocbf list`, a YAML file (relative to this one) or FILE:NAME.
        overrides: merged into the scenario.
        barriers: the cases to compare by name, each merged into the scenario after the overrides.
        sample: "random" draws points, "grid" takes all combinations.
        runs: number of runs in a random sample, all barriers together; a grid runs each of its points.
        repeats: on a grid, the runs of each point, each from another seed.
        seed: of the sample, and of each run's own seed.
        factors: how each field varies, by its dotted path in the scenario ("gait.stride", "pushes.0.force.1").
        maps: pairs of factors to draw survival over; null draws the first three numeric ones against each other.
        run_seconds: wall time after which a run is given up [s].
    """

    description: str = ""
    scenario: str
    overrides: dict[str, Any] = Field({})
    barriers: dict[str, dict[str, Any]] = Field({"as given": {}}, min_length=1)
    sample: Literal["random", "grid"] = "random"
    runs: int | None = Field(None, ge=1)
    repeats: int = Field(1, ge=1)
    seed: int = Field(0, ge=0)
    factors: dict[str, FactorConfig] = Field(min_length=1)
    maps: tuple[tuple[str, str], ...] | None = None
    run_seconds: float = Field(600.0, gt=0)

    @model_validator(mode="after")
    def _sample_fits(self) -> CampaignConfig:
        if (runs := self.size()) > MOST_RUNS:
            raise ValueError(f"at most {MOST_RUNS} runs are possible, given {runs}")
        if self.sample == "random":
            if self.runs is None:
                raise ValueError("a random sample needs runs, the number of runs")
            if self.repeats != 1:
                raise ValueError("repeats belongs to a grid; a random sample has runs")
            if any(factor.points is not None for factor in self.factors.values()):
                raise ValueError("points belongs to a grid; a random sample draws between low and high")
            return self
        if self.runs is not None:
            raise ValueError("runs belongs to a random sample; a grid runs all combinations, repeats times")
        for path, factor in self.factors.items():
            if factor.values is None and factor.points is None:
                raise ValueError(f"on a grid, factor '{path}' needs points, or values")
        return self

    @model_validator(mode="after")
    def _maps_exist(self) -> CampaignConfig:
        unknown = [path for pair in self.maps or () for path in pair if path not in self.factors]
        if unknown:
            raise ValueError(f"maps: '{unknown[0]}' is not a factor; there are {', '.join(self.factors)}")
        return self

    def size(self) -> int:
        """The number of runs."""
        if self.sample == "random":
            return self.runs or 0
        counts = (len(factor.values) if factor.values else factor.points or 1 for factor in self.factors.values())
        return self.repeats * math.prod(counts) * len(self.barriers)

    def points(self) -> Iterator[Point]:
        """The sample's points in order: a grid, or draws that do not depend on their number, so a sample can grow."""
        if self.sample == "random":
            for draw in range(math.ceil((self.runs or 0) / len(self.barriers))):
                generator, seed = drawing(self.seed, draw)
                yield Point({path: factor.drawn(generator) for path, factor in self.factors.items()}, seed)
            return
        axes = [factor.spaced() for factor in self.factors.values()]
        for index, (_, *values) in enumerate(itertools.product(range(self.repeats), *axes)):
            seed = int(np.random.default_rng([self.seed, index]).integers(2**31))
            yield Point(dict(zip(self.factors, values, strict=True)), seed)
