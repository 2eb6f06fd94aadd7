"""Errors of configs as sentences: each wrong key, what is allowed, and the value given."""

from __future__ import annotations

import reprlib
from collections.abc import Iterator
from types import NoneType, UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel

_OTHER_KIND = {"float_type", "int_type", "int_from_float", "bool_type", "string_type", "tuple_type", "dict_type"}
_OTHER_KIND |= {"model_type", "literal_error"}  # errors of values that are of another kind, not just out of limits
_SHOWN = 100  # the most characters of a given value in a message


def shown(value: Any) -> str:
    """A given value for a message: on one line of at most 100 characters."""
    short = reprlib.Repr()
    short.maxlevel, short.maxlist, short.maxtuple, short.maxdict, short.maxset = 3, 8, 8, 6, 6
    short.maxstring = short.maxother = _SHOWN
    text = short.repr(value)
    text = {"None": "null", "True": "true", "False": "false"}.get(text, text)
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."


def sentences(kind: type[BaseModel], items: list[Any], where: str) -> Iterator[str]:
    """A sentence for each mistake among the errors of pydantic for a `kind`; `where` is the place of its data."""
    items = _settled(kind, items, 0)
    places = [tuple(item["loc"]) for item in items]
    for item, place in zip(items, places, strict=True):
        if item["type"] == "missing" and isinstance(place[-1], int):
            # Each missing entry of a list is an item of its own; the last one has the number that is needed.
            if (*place[:-1], place[-1] + 1) not in places:
                yield _sentence(where, place[:-1], f"must have {_entries(place[-1] + 1)}", item["input"])
        elif item["type"] == "too_short" and any(len(p) > len(place) and p[: len(place)] == place for p in places):
            continue  # pydantic counts the valid entries; the others have items of their own
        elif item["type"] == "extra_forbidden":
            keys = ", ".join(item.get("keys") or _keys_beside(kind, place))
            message = f"unknown key; allowed here: {keys}" if keys else "unknown key"
            elsewhere = ", ".join(_places_of(kind, str(place[-1])))
            yield _sentence(where, place, f"{message}; there is {elsewhere}" if elsewhere else message)
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
        "union_tag_invalid": (
            f"{limits.get('discriminator')} must be one of {limits.get('expected_tags')}, not {limits.get('tag')!r}"
        ),
        "union_tag_not_found": f"{limits.get('discriminator')} is needed, but missing",
    }
    if item["type"] in words:
        return words[item["type"]]
    message = item["msg"].removeprefix("Value error, ")
    return f"{message[0].lower()}{message[1:]}"


def _entries(count: int | None) -> str:
    return f"{count} entry" if count == 1 else f"{count} entries"


def _settled(kind: Any, items: list[Any], start: int) -> list[Any]:
    """Errors without those of the alternatives of a union for which a value was not meant.

    For each alternative of a union pydantic has errors of its own, with a tag of the alternative in their places. The
    value is meant for the one of its kind, a list for a tuple or a map for a config; where none is, all are named.

    Args:
        kind: a type of the values at the places from index `start` on.
    """
    settled: list[Any] = []
    seen: set[tuple[Any, ...]] = set()
    for item in items:
        union, tag = _first_union(kind, item["loc"], start)
        place = item["loc"][:tag]
        if tag is None:
            settled.append(item)
        elif place not in seen:
            seen.add(place)
            settled += _of_union(union, [other for other in items if other["loc"][:tag] == place], tag)
    return settled


def _of_union(union: Any, items: list[Any], tag: int) -> list[Any]:
    """The errors of one value of a union, whose alternatives are tagged at an index of the places, without the tags."""
    other = {item["loc"][tag] for item in items if item["type"] in _OTHER_KIND and len(item["loc"]) == tag + 1}
    meant = next((item["loc"][tag] for item in items if item["loc"][tag] not in other), None)
    if meant is None:
        words = [_in_plain_words(item).removeprefix("must be ") for item in items]
        words += ["null"] if NoneType in get_args(union) else []
        message = f"must be {', '.join(words[:-1])} or {words[-1]}"
        return [{**items[0], "type": "value_error", "loc": items[0]["loc"][:tag], "msg": message}]
    option = next((each for each in _options(union) if _named(each, meant)), None)
    of_one = [
        {**item, "loc": (*item["loc"][:tag], *item["loc"][tag + 1 :])} for item in items if item["loc"][tag] == meant
    ]
    if isinstance(option, type) and issubclass(option, BaseModel):
        keys = _keys_of(option)
        of_one = [{**item, "keys": keys} if len(item["loc"]) == tag + 1 else item for item in of_one]
    return _settled(option, of_one, tag)


def _first_union(kind: Any, place: tuple[Any, ...], start: int) -> tuple[Any, int | None]:
    """The first union of several types along a place, and the index of the tag of its alternative; else None."""
    for index in range(start, len(place)):
        options = _options(kind)
        if len(options) > 1:
            return kind, index
        kind = _inside(options[0], place[index]) if options else None
    return kind, None


def _options(kind: Any) -> list[Any]:
    """The types of a union, without null and what is annotated; of any other type, itself."""
    while get_origin(kind) is Annotated:
        kind = get_args(kind)[0]
    if get_origin(kind) in (Union, UnionType):
        return [each for part in get_args(kind) if part is not NoneType for each in _options(part)]
    return [kind]


def _inside(kind: Any, part: Any) -> Any:
    """The type of a config's field, a list's entry or a map's value."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return kind.model_fields[part].annotation if part in kind.model_fields else None
    inner = get_args(kind)
    if get_origin(kind) is dict:
        return inner[1]
    if get_origin(kind) is tuple:
        return inner[0] if inner[-1] is Ellipsis else inner[part] if part < len(inner) else None
    return None


def _named(kind: Any, tag: str) -> bool:
    """Whether pydantic's tag, such as Gait, tuple[float, ...] or float, is that of a type."""
    if isinstance(kind, type) and issubclass(kind, BaseModel) and "kind" in kind.model_fields:
        return tag in get_args(kind.model_fields["kind"].annotation)
    name = getattr(get_origin(kind) or kind, "__name__", "")
    return bool(name) and tag.startswith(name)


def _keys_beside(kind: Any, location: tuple[Any, ...]) -> list[str]:
    """The keys that are allowed beside the last one of a location."""
    for part in location[:-1]:
        kind = next((found for each in _options(kind) if (found := _inside(each, part)) is not None), None)
    configs = (each for each in _options(kind) if isinstance(each, type) and issubclass(each, BaseModel))
    return sorted({key for each in configs for key in _keys_of(each)})


def _places_of(kind: Any, key: str, above: tuple[str, ...] = ()) -> Iterator[str]:
    """Where a key is allowed inside the configs of a config, not in their lists and maps."""
    for config in _options(kind):
        if not (isinstance(config, type) and issubclass(config, BaseModel)):
            continue
        for name, field in config.model_fields.items():
            place = (*above, field.alias or name)
            if above and place[-1] == key:
                yield ".".join(place)
            yield from _places_of(field.annotation, key, place)


def _keys_of(kind: type[BaseModel]) -> list[str]:
    """The keys that a config takes."""
    return sorted(field.alias or name for name, field in kind.model_fields.items())
