"""Writes the tables of rooms, signals, metrics and public names into their pages: `python docs/tables.py`."""

from __future__ import annotations

import ast
import inspect
import re
import sys
from pathlib import Path

from pydantic import BaseModel

import pdhocbf_drake
from pdhocbf_drake.analysis.metrics_schema import (
    BarrierMetrics,
    BoundMetrics,
    EstimatorMetrics,
    Metrics,
    MpcMetrics,
    PieceMetrics,
)
from pdhocbf_drake.systems.signals import LOGGED, Signal

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "pdhocbf_drake"
_SHOWN = 9  # elements of a signal that are named one by one
PAGES = tuple(ROOT / "docs" / name for name in ("how_it_is_built.md", "run_folder.md", "python.md"))


def rooms_table() -> str:
    """One row a room, from the lowest level of the contract of import-linter to the highest, with the rooms in it."""
    rows = ["| level | room | what it holds |", "|---|---|---|"]
    for level, layer in enumerate(layers(), start=1):
        for room in layer:
            rows.append(f"| {level} | `{room}/` | {_held(room)} |")
            inner = sorted(file.parent.name for file in PACKAGE.glob(f"{room}/*/__init__.py"))
            rows += [f"| | `{room}/{name}/` | {_held(f'{room}/{name}')} |" for name in inner]
    return "\n".join(rows)


def layers() -> list[list[str]]:
    """The rooms of each layer of the first contract, lowest first; layers of modules alone are left out."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contract = project["tool"]["importlinter"]["contracts"][0]
    found = [[name for name in re.findall(r"\w+", layer) if (PACKAGE / name).is_dir()] for layer in contract["layers"]]
    return [names for names in reversed(found) if names]


def _held(room: str) -> str:
    """The first paragraph of the docstring of a package."""
    text = (PACKAGE / room / "__init__.py").read_text(encoding="utf-8")
    return (ast.get_docstring(ast.parse(text)) or "").partition("\n\n")[0].replace("\n", " ")


def signals_table() -> str:
    """One row for each logged signal."""
    rows = [f"| `{s.name}` | {s.system} | {s.size} | {_elements(s)} | {s.unit} | {s.meaning} |" for s in LOGGED]
    return "\n".join(["| signal | system | size | elements | unit | meaning |", "|---|---|---|---|---|---|", *rows])


def _elements(signal: Signal) -> str:
    """The names of a signal's elements, of many the first and the last ones."""
    names = signal.elements
    return ", ".join(names if len(names) <= _SHOWN else [*names[: _SHOWN - 2], "…", names[-1]])


def metrics_table() -> str:
    """One row a field, those of barriers and MPC under their parent's name."""
    rows = ["| field | meaning |", "|---|---|"]
    for prefix, model in (
        ("", Metrics),
        ("barriers.NAME.", BarrierMetrics),
        ("mpc.", MpcMetrics),
        ("ground.NUMBER.", PieceMetrics),
        ("estimator.", EstimatorMetrics),
        ("plan_limits.NAME.", BoundMetrics),
    ):
        rows += [f"| `{prefix}{name}` | {text} |" for name, text in _fields(model)]
    return "\n".join(rows)


def _fields(model: type[BaseModel]) -> list[tuple[str, str]]:
    return [(f.alias or name, f.description) for name, f in model.model_fields.items() if f.description]


def face_table() -> str:
    """One row for each public name, with the first sentence of its docstring."""
    rows = ["| name | what it is |", "|---|---|"]
    for name in pdhocbf_drake.__all__:
        first = (inspect.getdoc(getattr(pdhocbf_drake, name)) or "").partition("\n\n")[0].replace("\n", " ")
        rows.append(f"| `{name}` | {first.replace('|', chr(92) + '|')} |")
    return "\n".join(rows)


def with_tables(text: str) -> str:
    """The text of a page with its tables renewed between their marks."""
    tables = {"rooms": rooms_table, "signals": signals_table, "metrics": metrics_table, "face": face_table}
    for name, table in ((name, write()) for name, write in tables.items() if f"<!-- {name} -->" in text):
        mark = re.compile(f"(<!-- {name} -->\n).*?(<!-- end of {name} -->)", re.DOTALL)
        text = mark.sub(lambda m, table=table: f"{m[1]}\n{table}\n\n{m[2]}", text)  # type: ignore[misc]
    return text


if __name__ == "__main__":
    for page in PAGES:
        page.write_text(with_tables(page.read_text(encoding="utf-8")), encoding="utf-8")
