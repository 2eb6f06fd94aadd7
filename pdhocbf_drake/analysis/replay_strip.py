"""The strip under a replay: h of each barrier, and what it bounds beside its bound, in step with the replay's time."""

from __future__ import annotations

import html
import json
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.barrier_margins import barriers_of, bound_along, h_along, measured, named, quantities_of
from pdhocbf_drake.analysis.pushes import spans_of
from pdhocbf_drake.simulation.run_folder import Run

Array = NDArray[np.float64]

HEIGHT: Final = 170  # [px]
_COLUMNS = 1500  # at most, of a curve
_SCRIPT = Path(__file__).with_suffix(".js")
_DIGITS = 5


def strip(run: Run) -> str:
    """The part of the page that draws it, and makes room for itself; nothing if there is nothing to plot."""
    plots = plots_of(run)
    if not plots:
        return ""
    time = run.log.time
    settled = run.scenario.from_time if time[-1] > run.scenario.from_time else float(time[0])
    data = {
        "start": float(time[0]), "end": float(time[-1]), "from": settled, "unsafe": palette.UNSAFE,
        "plots": list(plots.values()),
    }  # fmt: skip
    if pushes := spans_of(run):
        data |= {"pushes": pushes, "push": palette.PUSH}
    options = "".join(f"<option>{html.escape(name)}</option>" for name in plots)
    choice = f'<select id="strip-choice" title="barrier">{options}</select>' if len(plots) > 1 else ""
    text = json.dumps(data, allow_nan=False).replace("<", "\\u003c")
    return (
        f"<style>#meshcat-pane{{height:calc(100vh - {HEIGHT}px)!important}}"
        f"#strip{{position:fixed;left:0;bottom:0;width:100%;height:{HEIGHT}px;background:#fff;touch-action:none}}"
        f"#strip-choice{{position:fixed;right:12px;bottom:{HEIGHT - 26}px;font:11px system-ui,sans-serif}}</style>"
        f'<canvas id="strip"></canvas>{choice}<script>({_SCRIPT.read_text(encoding="utf-8")})({text})</script>'
    )


def plots_of(run: Run) -> dict[str, dict[str, Any]]:
    """What is drawn for each barrier, by its name; of a walk without one, its forward speed.

    `time` [s] and `parts`, each with its unit and its curves of a name, a colour and values. In a long run a curve has
    the row of least h of each interval, so that no violation is left out.
    """
    scenario, log = run.scenario, run.log
    if not scenario.barriers and scenario.system != "van_der_pol":
        quantity = quantities_of([scenario])[0]
        value = measured(run, quantity)
        rows = _rows(-value)
        return {quantity.name: _plot(run, rows, [_part(quantity.unit, rows, {named(run, quantity): value})])}
    found = {}
    for name, use in barriers_of(scenario).items():
        h, colour = h_along(log, scenario, use), palette.barrier_colour(use.column)
        rows, parts = _rows(h), []
        if use.quantity is not None:
            both = {"bound": bound_along(log, scenario, use), named(run, use.quantity): measured(run, use.quantity)}
            parts.append(_part(use.unit, rows, both, colour))
        parts.append(_part(use.unit, rows, {f"{name}: h": h}, colour) | {"floor": 0.0})
        found[name] = _plot(run, rows, parts)
    return found


def _plot(run: Run, rows: NDArray[np.intp], parts: list[dict[str, Any]]) -> dict[str, Any]:
    return {"time": run.log.time[rows].tolist(), "parts": parts}


def _part(unit: str, rows: NDArray[np.intp], curves: dict[str, Array], colour: str = "") -> dict[str, Any]:
    """Curves by name; the first one in the barrier's colour, if it has one."""
    colours = [colour or palette.MEASURED_COM, palette.MEASURED_COM]
    drawn = [
        {"name": name, "colour": own, "values": [_shown(value) for value in values[rows]]}
        for (name, values), own in zip(curves.items(), colours, strict=False)
    ]
    return {"unit": unit, "curves": drawn}


def _shown(value: float) -> float | None:
    """The value in few digits; None for NaN, where a barrier is not kept."""
    return None if np.isnan(value) else float(f"{value:.{_DIGITS}g}")


def _rows(h: Array) -> NDArray[np.intp]:
    """All rows, or of a long run those of least h in each of `_COLUMNS` intervals."""
    filled = np.nan_to_num(h, nan=np.inf)
    edges = np.unique(np.linspace(0, len(h), min(len(h), _COLUMNS) + 1).astype(int))
    return np.array([first + int(np.argmin(filled[first:last])) for first, last in pairwise(edges)])
