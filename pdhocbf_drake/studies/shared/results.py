"""JSON without NaN."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from pdhocbf_drake.files.file import write_text


def write_json(path: Path, data: Any, indent: int = 1) -> None:
    """Writes a file that is complete or not there, with null for NaN and infinity; raises as `replaced_file` does."""
    write_text(path, json.dumps(_plain(data), indent=indent, allow_nan=False, ensure_ascii=False) + "\n")


def _plain(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _plain(value) for key, value in data.items()}
    if isinstance(data, (list, tuple)):
        return [_plain(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data
