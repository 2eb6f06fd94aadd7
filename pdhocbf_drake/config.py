"""The base of all configuration: frozen, strict, and finite; a wrong value becomes one sentence.

Every room keeps its own `Config` beside the object made from it; `simulation.scenario` composes them.
"""

from __future__ import annotations

import json
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from pdhocbf_drake.errors import InputError


class Config(BaseModel):
    """What a user writes. Unknown keys, wrong types, NaN and infinity are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


C = TypeVar("C", bound=Config)


def parse_config(kind: type[C], data: Any, where: str) -> C:
    """Makes a `kind` from plain YAML data.

    Raises:
        InputError: one line per offending entry: where it is, what was given, what is allowed.
    """
    try:
        # Through JSON, because pydantic's strict mode then still takes a list for a tuple.
        return kind.model_validate_json(json.dumps(data))
    except ValidationError as error:
        raise InputError("; ".join(_sentence(kind, item, where) for item in error.errors())) from None
    except TypeError:
        raise InputError(f"{where}: only plain YAML values are allowed, given {data!r}") from None


def _sentence(kind: type[BaseModel], item: Any, where: str) -> str:
    location = tuple(item["loc"])
    path = ".".join([where, *(str(part) for part in location)])
    if item["type"] == "extra_forbidden":
        keys = _keys_beside(kind, location)
        return f"{path}: unknown key; allowed here: {', '.join(keys)}" if keys else f"{path}: unknown key"
    message = item["msg"].removeprefix("Value error, ")
    given = "" if item["type"] == "missing" else f" (given: {item['input']!r})"
    return f"{path}: {message[0].lower()}{message[1:]}{given}"


def _keys_beside(kind: Any, location: tuple[Any, ...]) -> list[str]:
    """The keys allowed in the model that `location`'s last part was written into."""
    model: Any = kind
    for part in location[:-1]:
        fields = getattr(model, "model_fields", {})
        if part in fields:
            model = fields[part].annotation
        for candidate in (model, *getattr(model, "__args__", ())):
            if hasattr(candidate, "model_fields"):
                model = candidate
    return sorted(getattr(model, "model_fields", {}))
