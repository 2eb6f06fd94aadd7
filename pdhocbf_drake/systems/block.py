"""The base of all blocks, which Python can free: a diagram and its blocks refer to each other in circles."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from typing import Any

from pydrake.systems.framework import LeafSystem


def _slotted() -> type:
    """The class of classes that have the attributes of Drake's own class, and no others.

    Drake's own where nothing can be below it, in releases for Python 3.12 and later, which need none.
    """
    own: Any = type(LeafSystem)

    def with_slots(kind: Any, name: str, bases: tuple[type, ...], namespace: dict[str, Any], **keywords: Any) -> Any:
        return own.__new__(kind, name, bases, {"__slots__": (), **namespace}, **keywords)

    try:
        return type("_Slotted", (own,), {"__new__": with_slots})
    except TypeError:
        return own


class Block(LeafSystem, metaclass=_slotted()):  # type: ignore[metaclass]
    """A `LeafSystem` that is freed with its diagram.

    A class below Drake's has a dictionary of attributes besides that of Drake. Python 3.11 then counts both as one
    that is visited twice, and frees no circle with such an object. An empty `__slots__` leaves out the second one.
    """


def weakly(method: Callable[..., None]) -> Callable[..., None]:
    """A block's method as the callback of one of its output ports, which does not keep the block alive.

    Drake keeps this callback where Python's collector does not see it, and calls it only while the block exists.
    """
    function: Any = method.__func__  # type: ignore[attr-defined]
    owner = weakref.ref(method.__self__)  # type: ignore[attr-defined]

    def call(*arguments: Any) -> None:
        function(owner(), *arguments)

    return call
