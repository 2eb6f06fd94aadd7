"""The base of all configs, frozen, strict and finite; types of their values; and errors in one sentence.

Every package keeps its configs beside the objects made from them; `simulation.scenario` composes them.
"""

from __future__ import annotations

import json
import re
import reprlib
from collections.abc import Callable, Iterator
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, ValidationError

from pdhocbf_drake.errors import InputError

_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}")
_SHOWN = 100  # the most characters of a given value in a message


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


def shown(value: Any) -> str:
    """A given value for a message: on one line of at most 100 characters."""
    short = reprlib.Repr()
    short.maxlevel, short.maxlist, short.maxtuple, short.maxdict, short.maxset = 3, 8, 8, 6, 6
    short.maxstring = short.maxother = _SHOWN
    text = short.repr(value)
    text = {"None": "null", "True": "true", "False": "false"}.get(text, text)
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."


def parse_config(kind: type[C], data: Any, where: str) -> C:
    """A `kind` from plain YAML data.

    Raises:
        InputError: with each wrong key, the value given and the allowed ones.
    """
    try:
        # Through JSON, because pydantic's strict mode then accepts a list for a tuple.
        return kind.model_validate_json(json.dumps(data))
    except ValidationError as error:
        raise InputError("; ".join(_sentences(kind, error.errors(), where))) from None
    except (TypeError, ValueError, RecursionError):
        raise InputError(f"{where}: only plain YAML values are allowed, given {shown(data)}") from None


def _sentences(kind: type[BaseModel], items: list[Any], where: str) -> Iterator[str]:
    places = [tuple(item["loc"]) for item in items]
    for item, place in zip(items, places, strict=True):
        if item["type"] == "missing" and isinstance(place[-1], int):
            # Each missing entry of a list is an item of its own; the last one has the number that is needed.
            if (*place[:-1], place[-1] + 1) not in places:
                yield _sentence(where, place[:-1], f"must have {_entries(place[-1] + 1)}", item["input"])
        elif item["type"] == "too_short" and any(p[:-1] == place for p in places):
            continue  # pydantic counts the valid entries; the others have items of their own
        elif item["type"] == "extra_forbidden":
            keys = ", ".join(_keys_beside(kind, place))
            yield _sentence(where, place, f"unknown key; allowed here: {keys}" if keys else "unknown key")
        elif item["type"] == "missing":
            yield _sentence(where, place, "is needed, but missing")
        else:
            yield _sentence(where, place, _in_plain_words(item), item["input"])


def _sentence(where: str, place: tuple[Any, ...], message: str, *given: Any) -> str:
    values = "".join(f" (given: {shown(value)})" for value in given if not isinstance(value, dict))
    return f"{'.'.join([where, *(str(part) for part in place if part != '[key]')])}: {message}{values}"


def _in_plain_words(item: Any) -> str:
    """The allowed values, in the words of YAML instead of Python's and pydantic's."""
    limits = item.get("ctx") or {}
    words = {
        "float_type": "must be a number",
        "int_type": "must be a whole number",
        "int_from_float": "must be a whole number",
        "bool_type": "must be true or false",
        "string_type": "must be text",
        "tuple_type": "must be a list",
        "dict_type": "must be a map of keys and values",
        "model_type": "must be a map of keys and values",
        "finite_number": "must be a finite number",
        "literal_error": f"must be {limits.get('expected')}",
        "greater_than": f"must be above {limits.get('gt', 0):g}",
        "greater_than_equal": f"must be at least {limits.get('ge', 0):g}",
        "less_than": f"must be below {limits.get('lt', 0):g}",
        "less_than_equal": f"must be at most {limits.get('le', 0):g}",
        "too_short": f"must have at least {_entries(limits.get('min_length'))}",
        "too_long": f"must have at most {_entries(limits.get('max_length'))}",
    }
    if item["type"] in words:
        return words[item["type"]]
    message = item["msg"].removeprefix("Value error, ")
    return f"{message[0].lower()}{message[1:]}"


def _entries(count: int | None) -> str:
    return f"{count} entry" if count == 1 else f"{count} entries"


def _keys_beside(kind: Any, location: tuple[Any, ...]) -> list[str]:
    """The keys that are allowed beside the last one of a location."""
    model: Any = kind
    for part in location[:-1]:
        fields = getattr(model, "model_fields", {})
        if part in fields:
            model = fields[part].annotation
        for candidate in (model, *getattr(model, "__args__", ())):
            if hasattr(candidate, "model_fields"):
                model = candidate
    return sorted(getattr(model, "model_fields", {}))
