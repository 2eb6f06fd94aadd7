"""A name for what programs are made from, the same in every process."""

from __future__ import annotations

import hashlib
from collections.abc import Hashable
from dataclasses import astuple, is_dataclass
from typing import Any

_PLAIN = (str, bytes, bool, int, float, type(None))


def digest(key: Hashable) -> str | None:
    """A hash of plain values, types, and dataclasses and tuples of these; None where anything else is among them."""
    try:
        return hashlib.sha256(repr(_plain(key)).encode()).hexdigest()[:32]
    except TypeError:
        return None


def _plain(key: Any) -> object:
    if type(key) in _PLAIN:
        return key
    if isinstance(key, type):
        return f"{key.__module__}.{key.__qualname__}"
    if isinstance(key, tuple):
        return tuple(map(_plain, key))
    if is_dataclass(key) and not isinstance(key, type):
        return _plain(type(key)), _plain(astuple(key))
    raise TypeError
