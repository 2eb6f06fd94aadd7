"""What is made once and kept, by what it was made from."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator
from typing import Generic, TypeVar

T = TypeVar("T")


class Kept(Generic[T]):
    """Things by their keys, each made when it is first asked for.

    Args:
        most: beyond this number the one that was not asked for longest is dropped; None keeps all.
    """

    def __init__(self, most: int | None = None) -> None:
        self._most, self._things = most, dict[Hashable, T]()

    def __len__(self) -> int:
        return len(self._things)

    def __contains__(self, key: Hashable) -> bool:
        return key in self._things

    def __iter__(self) -> Iterator[T]:
        return iter(self._things.values())

    def get(self, key: Hashable, make: Callable[[], T]) -> T:
        """What is kept under the key, otherwise what `make` returns."""
        thing = self._things.pop(key) if key in self._things else make()
        self._things[key] = thing  # at the end, as the one asked for last
        while self._most is not None and len(self._things) > self._most:
            del self._things[next(iter(self._things))]
        return thing
