"""Style of all figures: sizes, grids, labels with units, legends; and writing them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.mathtext import MathTextParser
from matplotlib.text import Text

from pdhocbf_drake.analysis import palette

_STYLE: dict[str, Any] = {
    "font.size": 10,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#E6E6E6",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "lines.linewidth": 1.5,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "savefig.dpi": 130,
    "figure.constrained_layout.use": True,
}


@contextmanager
def styled() -> Iterator[None]:
    """Gives figures made inside the common style; a user's own matplotlib settings are restored at the end."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        parameters: Any = matplotlib.rcParams  # typed with every key spelt out
        parameters.update(_STYLE)
        yield


def panels(rows: int, height: float = 2.3, width: float = 8.5, **kwargs: Any) -> tuple[Figure, list[Axes]]:
    """A figure with `rows` panels above each other that share the horizontal axis [inches]."""
    figure = Figure(figsize=(width, height * rows + 0.5))
    return figure, list(figure.subplots(rows, 1, sharex=True, squeeze=False, **kwargs).flat)


def label(axes: Axes, quantity: str, unit: str) -> None:
    """Labels the vertical axis, with the unit."""
    axes.set_ylabel(f"{quantity} [{unit}]")


def legend(axes: Axes, columns: int = 4) -> None:
    """Puts the legend above the panel, where it hides no data."""
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, borderaxespad=0.1, handlelength=2.2)


def time_axis(axes: list[Axes]) -> None:
    """Labels the time axis of the lowest panel, and lets the lines of all panels fill the width."""
    axes[-1].set_xlabel("time [s]")
    for axis in axes:
        axis.margins(x=0)


def over_time(
    figure: Figure, columns: int = 4, every_panel: bool = False, pushes: Iterable[tuple[float, float]] = ()
) -> Figure:
    """The figure with its time axis, with pushes from start to end [s], and a legend above the first or every panel."""
    for place, (start, end) in enumerate(pushes):
        for axes in figure.axes:
            name = "_" if place else "push"
            axes.axvspan(start, end, color=palette.PUSH, alpha=0.6, linewidth=1.0, zorder=0.5, label=name)
    for axes in figure.axes if every_panel else figure.axes[:1]:
        legend(axes, columns)
    time_axis(figure.axes)
    return figure


def save(figure: Figure, path: Path | BinaryIO) -> None:
    """Writes a PNG without a date in it, so that the same run gives the same bytes; raises `OSError`."""
    for text in figure.findobj(Text):
        if isinstance(text, Text) and not _drawable(text.get_text()):
            text.set_parse_math(False)
    # `figure.savefig` draws once more before, only for the layout, which drawing makes anyway.
    figure.set_dpi(_STYLE["savefig.dpi"])
    canvas: Any = FigureCanvasAgg(figure)  # untyped
    canvas.print_png(path, metadata={"Software": None})


def _drawable(text: str) -> bool:
    """Whether the formulas between dollars, if the text has any, can be drawn: the words may be a user's."""
    if "$" not in text:
        return True
    try:
        MathTextParser("path").parse(text)
    except ValueError:
        return False
    return True
