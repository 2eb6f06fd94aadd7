"""The base of all blocks, which Python can free: a diagram and its blocks refer to each other in circles."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from typing import Any

from pydrake.systems.framework import LeafSystem


class _Slotted(type(LeafSystem)):  # type: ignore[misc]
    """Leaves a class the attributes of Drake's own class, and no others."""

    def __new__(cls, name: str, bases: tuple[type, ...], namespace: dict[str, Any], **keywords: Any) -> type:
        return super().__new__(cls, name, bases, {"__slots__": (), **namespace}, **keywords)


class Block(LeafSystem, metaclass=_Slotted):
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
