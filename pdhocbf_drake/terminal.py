"""Output of commands: progress of a long one, lines on standard error, and tables of aligned columns."""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any, Protocol

_LINES = 10  # plain lines of a command, and more where they would be far apart:
_SILENCE = 60.0  # the longest time between two of them [s]
_PATIENCE = 10.0  # time without a first report after which one line says that the command is running [s]


class Progress(Protocol):
    """Reports the amount done, in the unit of the total, with a few words on it."""

    def __call__(self, done: float, words: str = "", /) -> None: ...


@contextmanager
def shown_progress(name: str, total: float, unit: str, done: float = 0, every: bool = False) -> Iterator[Progress]:
    """Shows a command's progress on standard error: a bar with the time left on a terminal, plain lines otherwise.

    The pace counts from the last report of no more than was done before, which says that all is prepared.

    Args:
        name: printed first.
        total: amount to do; shown with one decimal if it is a float.
        unit: of the amounts.
        done: amount that an earlier command has done; it does not count towards the pace.
        every: print a line at each report instead of `_LINES` lines in all. Without effect on a terminal.
    """
    digits = ".1f" if isinstance(total, float) else ".0f"
    amounts = total, unit, done, digits
    with _bar(name, *amounts) if sys.stderr.isatty() else _lines(name, *amounts, every) as progress:
        yield progress


@contextmanager
def _bar(name: str, total: float, unit: str, done: float, digits: str) -> Iterator[Progress]:
    amount = f"{{n:{digits}}} of {{total:{digits}}} {unit}"
    from tqdm import tqdm  # here, since it takes a tenth of a second to load

    form = f"{{desc}} {{percentage:3.0f}}%|{{bar}}| {amount} [{{elapsed}}<{{remaining}}{{postfix}}]"
    with tqdm(total=total, initial=done, desc=name, bar_format=form, file=sys.stderr) as bar:

        def progress(now: float, words: str = "") -> None:
            if now <= done:
                bar.unpause()
            bar.set_postfix_str(words, refresh=False)
            bar.update(min(now, total) - bar.n)
            if words:
                bar.refresh()

        yield progress


@contextmanager
def _lines(name: str, total: float, unit: str, done: float, digits: str, every: bool) -> Iterator[Progress]:
    started = printed_at = paced = time.monotonic()
    printed = _share(done, total)

    def progress(now: float, words: str = "") -> None:
        nonlocal printed, printed_at, paced
        waiting.cancel()
        due, clock = _share(now, total), time.monotonic()
        if now <= done:  # prepared
            paced = clock
        if not (every or due > printed or clock - printed_at > _SILENCE):
            return
        printed, printed_at = due, clock
        line = f"{name}: {now:{digits}} of {total:{digits}} {unit} in {clock - started:.1f} s"
        if done < now < total:
            line += f", about {(total - now) * (clock - paced) / (now - done):.0f} s left"
        say(f"{line}, {words}" if words else line)

    waiting = threading.Timer(_PATIENCE, say, [f"{name}: still being prepared"])
    waiting.daemon = True
    waiting.start()
    try:
        yield progress
    finally:
        waiting.cancel()


def _share(done: float, total: float) -> int:
    """The number of plain lines that are due; all where there is nothing to do."""
    return int(_LINES * done / total + 1e-9) if total else _LINES


def say(text: str) -> None:
    """Prints one line on standard error; an error in that, such as a closed terminal, does not stop a command."""
    with suppress(OSError):
        print(text, file=sys.stderr, flush=True)


def table(rows: Sequence[Sequence[Any]], header: Sequence[str] = ()) -> str:
    """Columns two spaces apart, under a header with a rule if there is one.

    A column of numbers alone is aligned to the right. None and NaN are dashes, floats have four significant digits.
    """
    columns = list(zip(*rows, strict=True)) or [()] * len(header)
    numbers = [all(value is None or isinstance(value, (int, float)) for value in column) for column in columns]
    cells = [list(header)] * bool(header) + [[_cell(value) for value in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    formats = [f"{{:{'>' if number else '<'}{width}}}" for number, width in zip(numbers, widths, strict=True)]
    lines = ["  ".join(formats).format(*row) for row in cells]
    if header:
        lines.insert(1, "-" * len(lines[0]))
    return "\n".join(line.rstrip() for line in lines)


def _cell(value: Any) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.1e}" if 0 < abs(value) < 1e-3 else f"{value:.4g}"
    return str(value)
