"""Report pages of one run or of several side by side, and the files of a run folder that are made from its log."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import yaml
from markupsafe import escape

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.answers import Answer, answers
from pdhocbf_drake.analysis.comparison import comparison_figures
from pdhocbf_drake.analysis.degraded import degraded_rows
from pdhocbf_drake.analysis.figures import Picture, figures_of, rendered, write_pictures
from pdhocbf_drake.analysis.glossary import words_in
from pdhocbf_drake.analysis.metrics import compute_metrics
from pdhocbf_drake.analysis.metrics_schema import Metrics
from pdhocbf_drake.analysis.page import data_url, filled_page
from pdhocbf_drake.analysis.pushes import push_answer, push_rows
from pdhocbf_drake.analysis.robot_limits import robot_limits
from pdhocbf_drake.analysis.summary import summary_rows
from pdhocbf_drake.analysis.titles import title_of
from pdhocbf_drake.files.file import write_text
from pdhocbf_drake.simulation.run_folder import FIGURES, METRICS, REPORT, Run

_MARK = "\x00"  # which no text of a page has
_PIECE = 2**20  # characters of a replay that are written at a time


class ReportedRun(NamedTuple):
    """A run with its metrics, its pictures, and its replay as a page of its own, or None."""

    run: Run
    metrics: Metrics
    pictures: list[Picture]
    replay: str | None


def metrics_of(run: Run) -> Metrics:
    """The run's metrics."""
    return compute_metrics(run.scenario, run.log, run.provenance.wall_seconds, robot_limits(run.scenario))


def reported(run: Run, replay: str | None, metrics: Metrics | None = None) -> ReportedRun:
    """The run with its pictures, and with its metrics, which are computed where they are not given."""
    pictures = rendered(figures_of(run, robot_limits(run.scenario)))
    return ReportedRun(run, metrics or metrics_of(run), pictures, replay)


def write_metrics(run: Run, folder: Path) -> Metrics:
    """Writes metrics.json and returns the metrics."""
    metrics = metrics_of(run)
    write_text(folder / METRICS, metrics.to_json())
    return metrics


def write_report(run: Run, metrics: Metrics, folder: Path, replay: str | None) -> None:
    """Writes the figures, and report.html with them and the replay."""
    shown = reported(run, replay, metrics)
    write_pictures(shown.pictures, folder / FIGURES)
    write_text(folder / REPORT, report_pieces([shown]))


def report_html(runs: Sequence[ReportedRun]) -> str:
    """The page, which holds its figures and replays and loads nothing."""
    return "".join(report_pieces(runs))


def report_pieces(runs: Sequence[ReportedRun]) -> Iterator[str]:
    """The same piece by piece, as replays of tens of megabytes are better not copied as a whole."""
    for place, piece in enumerate(_page(runs).split(_MARK)):
        if place % 2 == 0:
            yield piece
            continue
        replay = runs[int(piece)].replay or ""
        for start in range(0, len(replay), _PIECE):
            yield escape(replay[start : start + _PIECE])


def _page(runs: Sequence[ReportedRun]) -> str:
    """The page with a number between two marks in the place of each replay."""
    columns = [
        dict([*summary_rows(reported.metrics), *push_rows(reported.run), *degraded_rows(reported.run)])
        for reported in runs
    ]
    asked = _answers(runs)
    texts = [answer.text for row in asked for answer in row]
    texts += [f"{name} {text}" for column in columns for name, text in column.items()]
    shared = comparison_figures([reported.run for reported in runs])
    # The scenarios' names, numbered where they are the same.
    names = [title_of(reported.run.scenario) for reported in runs]
    labels = [name if names.count(name) == 1 else f"{name} ({index + 1})" for index, name in enumerate(names)]
    return filled_page(
        "analysis",
        title=" and ".join(dict.fromkeys(names)),
        labels=labels,
        answers=asked,
        words=words_in("\n".join(texts)),
        colours={True: palette.SAFE, False: palette.UNSAFE, None: palette.BOX},
        rows=[(row, [column.get(row, "–") for column in columns]) for row in dict.fromkeys(chain(*columns))],
        shared=_images(rendered(shared)),
        runs=[
            {
                "label": label,
                "description": reported.run.scenario.description,
                "figures": _images(reported.pictures),
                "replay": None if reported.replay is None else f"{_MARK}{index}{_MARK}",
                "scenario": _yaml(reported.run.scenario.to_dict()),
                "provenance": _yaml(reported.run.provenance.model_dump()),
            }
            for index, (label, reported) in enumerate(zip(labels, runs, strict=True))
        ],
    )


def _answers(runs: Sequence[ReportedRun]) -> list[tuple[Answer, ...]]:
    """For each question the answers of all runs; that on pushes comes second, if any run has some."""
    rows = list(zip(*(answers(reported.metrics) for reported in runs), strict=True))
    if any(push_rows(reported.run) for reported in runs):
        rows.insert(1, tuple(push_answer(reported.run) for reported in runs))
    return rows


def _images(pictures: Sequence[Picture]) -> list[tuple[str, str]]:
    """(caption, address of the image) of each picture."""
    return [(picture.caption, data_url(picture.image)) for picture in pictures]


def _yaml(data: object) -> str:
    return yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=100)
