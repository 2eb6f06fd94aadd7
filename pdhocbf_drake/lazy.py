"""Names of a package that are loaded when they are first used: its light modules load without its heavy ones."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping, Sequence
from types import ModuleType
from typing import Any


class _Package(ModuleType):
    """A package in which a module doesn't take the place of a name that is the same as its own."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (isinstance(value, ModuleType) and name in self.__dict__["_lazy"]):
            super().__setattr__(name, value)


def lazy_names(
    package: str, homes: Mapping[str, Sequence[str]]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """The functions `__getattr__` and `__dir__` of a package.

    Args:
        package: its `__name__`.
        homes: for each of its modules the names that it defines for the package.
    """
    places = {name: module for module, names in homes.items() for name in names}
    this = sys.modules[package]
    this.__dict__["_lazy"] = frozenset(places)
    this.__class__ = _Package

    def load(name: str) -> Any:
        if name not in places:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(importlib.import_module(f"{package}.{places[name]}"), name)
        setattr(this, name, value)
        return value

    def names() -> list[str]:
        return sorted({*vars(this), *places})

    return load, names
