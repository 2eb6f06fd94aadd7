"""Fields of a scenario by dotted path: "gait.stride", "pushes.0.force.1", "barriers.forward_speed.gamma"."""

from __future__ import annotations

from typing import Any

from pdhocbf_drake.errors import InputError


def has_field(data: Any, path: str) -> bool:
    """Whether that field exists."""
    try:
        set_field(data, path, None)
    except InputError:
        return False
    return True


def set_field(data: Any, path: str, value: Any) -> Any:
    """A copy of plain `data` with the field at `path` replaced.

    Raises:
        InputError: there is no such field; the message names those there are.
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
