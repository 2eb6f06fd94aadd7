"""The table of equations is complete: every equation of the paper, a symbol that exists, a test that exists."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
ROW = re.compile(r"^\| ([(), \d–]+?) \| ([^|]+) \| `([\w.]+)` \| `(test_\w+\.py)::(test_\w+)` \|$", re.MULTILINE)
LAST = 39


def _rows():
    return ROW.findall((ROOT / "docs" / "equations.md").read_text(encoding="utf-8"))


def _numbers(cell):
    """The equations that a cell such as "(8)–(10)" or "(12), (13)" names."""
    found: list[int] = []
    for part in cell.split(","):
        ends = [int(number) for number in re.findall(r"\d+", part)]
        found += range(ends[0], ends[-1] + 1)
    return found


def test_every_equation_has_one_row():
    numbers = [number for cell, *_ in _rows() for number in _numbers(cell)]
    assert sorted(numbers) == list(range(1, LAST + 1))


def test_every_symbol_exists():
    for _, _, symbol, _, _ in _rows():
        module, name = symbol.rsplit(".", 1)
        assert hasattr(importlib.import_module(f"pdhocbf_drake.{module}"), name), symbol


def test_every_test_exists():
    for _, _, _, file, name in _rows():
        assert f"def {name}(" in (ROOT / "tests" / file).read_text(encoding="utf-8"), f"{file}::{name}"
