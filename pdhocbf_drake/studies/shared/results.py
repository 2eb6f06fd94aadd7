"""Results of long work as far as it went, and JSON without NaN."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, TypeVar

from pdhocbf_drake.errors import PdhocbfError, reason
from pdhocbf_drake.files.file import write_text

Result = TypeVar("Result")


def collected(
    found: Iterable[Sequence[Result]], keep: bool, progress: Callable[[int], None] | None = None
) -> tuple[list[Result], str]:
    """Results as they come, and why no more came: "" after the last one.

    Args:
        found: the results, some at a time.
        keep: whether Ctrl-C, or an error for users, only ends the work where there are results.
        progress: called with the number of results so far.
    """
    results: list[Result] = []
    try:
        for more in found:
            results += more
            if progress is not None:
                progress(len(results))
    except (KeyboardInterrupt, PdhocbfError) as error:
        if not (keep and results):
            raise
        return results, reason(error)
    return results, ""


def write_json(path: Path, data: Any, indent: int = 1) -> None:
    """Writes a file that is complete or not there, with null for NaN and infinity; raises as `replaced_file` does."""
    write_text(path, json.dumps(_plain(data), indent=indent, allow_nan=False, ensure_ascii=False) + "\n")


def _plain(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _plain(value) for key, value in data.items()}
    if isinstance(data, (list, tuple)):
        return [_plain(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data
