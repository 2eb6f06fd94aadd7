"""The base of all configs, frozen, strict and finite, and types of their values.

Every package keeps its configs beside the objects made from them; `simulation.scenario` composes them.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, ValidationError

from pdhocbf_drake.config_errors import sentences, shown
from pdhocbf_drake.errors import InputError

_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}")


class Config(BaseModel):
    """A map of keys and values that a user writes. Unknown keys, wrong types, NaN and infinity are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


C = TypeVar("C", bound=Config)


def limited(low: float, high: float, unit: str, *, above: bool = False) -> Callable[[float], float]:
    """A function that returns a number from `low` (or above it) to `high`, and raises `ValueError` for others."""

    def check(value: float) -> float:
        if not low <= value <= high or (above and value == low):
            range_ = f"above {low:g} and up to {high:g}" if above else f"from {low:g} to {high:g}"
            raise ValueError(f"must be {range_} {unit}".rstrip())
        return value

    return check


def within(low: float, high: float, unit: str, *, above: bool = False) -> AfterValidator:
    """The same check for `Annotated[float, within(…)]`."""
    return AfterValidator(limited(low, high, unit, above=above))


def _named(text: str) -> str:
    if not _NAME.fullmatch(text):
        raise ValueError("must be 1 to 100 letters, digits, '_', '-' or '.', the first one no '-' or '.'")
    return text


Name = Annotated[str, AfterValidator(_named)]
"""Text that is safe in a file's name, a plot's label and a line on a terminal."""

Length = Annotated[float, within(0.0, 10.0, "m", above=True)]
"""A length on a walking robot [m]; one in millimetres is refused."""


def as_name(text: str) -> str:
    """A `Name` made of any text, such as the stem of a file."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "-", text).lstrip("-.")[:100] or "scenario"


def parse_config(kind: type[C], data: Any, where: str) -> C:
    """A `kind` from plain YAML data.

    Raises:
        InputError: with each wrong key, the value given and the allowed ones.
    """
    try:
        # Through JSON, because pydantic's strict mode then accepts a list for a tuple.
        return kind.model_validate_json(json.dumps(data))
    except ValidationError as error:
        raise InputError("; ".join(sentences(kind, error.errors(), where))) from None
    except (TypeError, ValueError, RecursionError):
        raise InputError(f"{where}: only plain YAML values are allowed, given {shown(data)}") from None
