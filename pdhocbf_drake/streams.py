"""Standard output and error of a command, which may be closed, full, or without some characters."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO

from pdhocbf_drake.errors import reason


class Stream:
    """A text stream on which writing never raises.

    Characters that it lacks are replaced by "?". After the first error nothing more is written.

    Attributes:
        problem: the first error in one sentence, or "".
        replaced: whether a character has been replaced.
    """

    def __init__(self, stream: TextIO | None) -> None:
        self._stream = stream
        self.problem, self.replaced = "", False

    def write(self, text: str) -> int:
        if self._stream is None:
            self.problem = self.problem or "it is closed"
        elif not self.problem:
            try:
                self._stream.write(text)
            except UnicodeEncodeError:
                self.replaced = True
                known = self._stream.encoding or "ascii"
                self.write(text.encode(known, "replace").decode(known))
            except (OSError, ValueError) as error:  # ValueError: closed by this process
                self._give_up(error)
        return len(text)

    def flush(self) -> None:
        if self._stream is not None and not self.problem:
            try:
                self._stream.flush()
            except (OSError, ValueError) as error:
                self._give_up(error)

    def isatty(self) -> bool:
        return self._stream is not None and self._stream.isatty()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def _give_up(self, error: Exception) -> None:
        self.problem = reason(error)
        # Python writes what is left in the buffer once more at its end, and would fail once more.
        with suppress(OSError, ValueError, AttributeError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), self._stream.fileno())  # type: ignore[union-attr]


@contextmanager
def safe_streams() -> Iterator[Stream]:
    """Standard output, and error, as a `Stream` within the block."""
    for number in (0, 1, 2):  # else the next file that is opened gets a closed one's number, and what others print
        try:
            os.fstat(number)
        except OSError:
            null = os.open(os.devnull, os.O_RDWR)
            if null != number:
                os.dup2(null, number)
                os.close(null)
    before = sys.stdout, sys.stderr
    output: Any = Stream(sys.stdout)
    errors: Any = Stream(sys.stderr)
    sys.stdout, sys.stderr = output, errors
    try:
        yield output
    finally:
        output.flush()
        errors.flush()
        sys.stdout, sys.stderr = before
