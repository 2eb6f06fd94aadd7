"""Comparison of runs: the safety margins (5), their ratio (6), and figures with one colour per run."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.barrier_margins import barriers_of, bound_along, h_along, measured, quantities_of, units_of
from pdhocbf_drake.analysis.drawing import label, over_time, panels, styled
from pdhocbf_drake.analysis.figures import Drawn
from pdhocbf_drake.analysis.pushes import Span, spans_of
from pdhocbf_drake.analysis.titles import title_of
from pdhocbf_drake.barriers.margin import margin_ratio, safety_margin
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.run_folder import Run


class Comparison(NamedTuple):
    """A barrier in each of two runs: its names, the safety margins (5) [unit] and their ratio (6) [1]."""

    names: tuple[str, str]
    margins: tuple[float, float]
    ratio: float
    unit: str


def compare(
    first: Run, second: Run, from_time: float, places: tuple[str, str] = ("the first run", "the second run")
) -> list[Comparison]:
    """Compares the barriers that have the same name in both runs; or the only one of each.

    Args:
        from_time: start of the compared part of both runs [s].
        places: names of the runs in messages.

    Raises:
        InputError: the runs share no barrier, or one of them has less than a period of the bound from `from_time` on.
    """
    uses = barriers_of(first.scenario), barriers_of(second.scenario)
    pairs = [(name, name) for name in uses[0] if name in uses[1]]
    if not pairs and len(uses[0]) == len(uses[1]) == 1:
        pairs = [(next(iter(uses[0])), next(iter(uses[1])))]
    if not pairs:
        have = " and ".join(", ".join(use) or "none" for use in uses)
        raise InputError(f"the runs share no barrier to compare; they have {have}")
    result = []
    for names in pairs:
        records = []
        for run, use, name, place in zip((first, second), uses, names, places, strict=True):
            rows = run.log.after(from_time)
            if len(rows) < use[name].period:
                ended = f"{run.log.time[-1]:.2f} s" if len(run.log) else "once"
                period = f"a period of {use[name].period * run.scenario.tick:g} s"
                raise InputError(f"{place} has less than {period} from {from_time:g} s on: it ended at {ended}")
            h = h_along(rows, run.scenario, use[name])
            if not np.isfinite(h).all():
                raise InputError(f"{place} can't be compared: h of its barrier {name} is no number at some ticks")
            records.append(h)
        margins = safety_margin(records[0]), safety_margin(records[1])
        result.append(Comparison(names, margins, margin_ratio(*records), uses[0][names[0]].unit))
    return result


def comparison_figures(runs: Sequence[Run]) -> list[Drawn]:
    """The bounded quantities under their bounds, and h, with all walks in one panel; none for fewer than two walks."""
    walks = [run for run in runs if run.scenario.system != "van_der_pol" and len(run.log) > 1]
    if len(walks) < 2:
        return []
    with styled():
        names = " and ".join(quantity.label for quantity in quantities_of(run.scenario for run in walks))
        drawn = [Drawn("velocities", f"{names} of each run, under its bounds", _quantities(walks))]
        if any(run.scenario.barriers for run in walks):
            drawn.append(Drawn("margins", "Barriers of each run on the measured state", _margins(walks)))
    return drawn


def _quantities(runs: Sequence[Run]) -> Figure:
    bounded = quantities_of(run.scenario for run in runs)
    figure, axes = panels(len(bounded), height=3.2)
    for axis, quantity in zip(axes, bounded, strict=True):
        for run, colour in zip(runs, cycle(palette.RUNS), strict=False):
            name = title_of(run.scenario)
            axis.plot(run.log.time, measured(run, quantity), color=colour, lw=1.0, label=name)
            for barrier, use in barriers_of(run.scenario).items():
                if use.quantity == quantity:
                    bound = bound_along(run.log, run.scenario, use)
                    axis.plot(run.log.time, bound, color=colour, ls="--", label=f"{name}: bound of {barrier}")
        label(axis, quantity.label, quantity.unit)
    return over_time(figure, 3, pushes=_shared_pushes(runs))


def _margins(runs: Sequence[Run]) -> Figure:
    figure, axes = panels(1, height=3.0)
    for run, colour in zip(runs, cycle(palette.RUNS), strict=False):
        uses = barriers_of(run.scenario).items()
        for (barrier, use), style in zip(uses, cycle(("-", "--", "-.", ":")), strict=False):
            h = h_along(run.log, run.scenario, use)
            axes[0].plot(run.log.time, h, color=colour, ls=style, lw=1.1, label=f"{title_of(run.scenario)}: {barrier}")
    axes[0].axhline(0.0, color=palette.LIMIT, ls=":")
    label(axes[0], "h", units_of(run.scenario for run in runs))
    return over_time(figure, 3, pushes=_shared_pushes(runs))


def _shared_pushes(runs: Sequence[Run]) -> list[Span]:
    """The spans of pushes that all runs have, as one figure shows them all."""
    return sorted(set.intersection(*(set(spans_of(run)) for run in runs)))
