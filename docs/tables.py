"""Writes the README's tables of signals and metrics from the code: `python docs/tables.py`."""

from __future__ import annotations

import re
from pathlib import Path

from pydantic import BaseModel

from pdhocbf_drake.analysis.metrics_schema import BarrierMetrics, Metrics, MpcMetrics
from pdhocbf_drake.systems.signals import LOGGED

README = Path(__file__).parents[1] / "README.md"


def signals_table() -> str:
    """One row for each logged signal."""
    rows = [f"| `{s.name}` | {s.system} | {s.size} | {s.unit} | {s.meaning} |" for s in LOGGED]
    return "\n".join(["| signal | system | size | unit | meaning |", "|---|---|---|---|---|", *rows])


def metrics_table() -> str:
    """One row a field, those of barriers and MPC under their parent's name."""
    rows = ["| field | meaning |", "|---|---|"]
    for prefix, model in (("", Metrics), ("barriers.NAME.", BarrierMetrics), ("mpc.", MpcMetrics)):
        rows += [f"| `{prefix}{name}` | {text} |" for name, text in _fields(model)]
    return "\n".join(rows)


def _fields(model: type[BaseModel]) -> list[tuple[str, str]]:
    return [(f.alias or name, f.description) for name, f in model.model_fields.items() if f.description]


def with_tables(text: str) -> str:
    """The README's text with both tables renewed between their marks."""
    for name, table in (("signals", signals_table()), ("metrics", metrics_table())):
        mark = re.compile(f"(<!-- {name} -->\n).*?(<!-- end of {name} -->)", re.DOTALL)
        text = mark.sub(lambda m, table=table: f"{m[1]}\n{table}\n\n{m[2]}", text)  # type: ignore[misc]
    return text


if __name__ == "__main__":
    README.write_text(with_tables(README.read_text(encoding="utf-8")), encoding="utf-8")
