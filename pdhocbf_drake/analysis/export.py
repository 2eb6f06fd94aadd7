"""A run's log as CSV and as MCAP, for programs that draw signals over time, such as PlotJuggler and Foxglove."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path
from typing import Final

from pdhocbf_drake.analysis.barrier_margins import barriers_of
from pdhocbf_drake.errors import InputError, RunFolderError
from pdhocbf_drake.files.file import replaced_file
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.systems.signals import LOGGED

_SIGNALS = {signal.name: signal for signal in LOGGED}
_OF_BARRIERS = ("h", "barrier_slack", "barrier_active")  # signals with one element for each barrier
_NANOSECONDS = 1_000_000_000

MISSING_MCAP: Final = (
    "MCAP needs the package 'mcap'; install it with pip install '.[export]' in this package's repository"
)


def elements_of(run: Run) -> dict[str, tuple[str, ...]]:
    """The names of the elements of each signal of a run's log, in the order of the log.

    They are those of `systems.signals`; of h, barrier_slack and barrier_active the barriers' names; elsewhere
    0, 1, 2, ….
    """
    barriers = tuple(barriers_of(run.scenario))
    named = {}
    for name, table in run.log.signals.items():
        size = table.shape[1]
        names = barriers if name in _OF_BARRIERS else _SIGNALS[name].elements if name in _SIGNALS else ()
        named[name] = names if len(names) == size else tuple(map(str, range(size)))
    return named


def write_csv(run: Run, place: Path) -> None:
    """Writes a row for each tick: time [s], then SIGNAL.ELEMENT for each element; every digit is kept.

    Raises:
        RunFolderError: `place` exists, or can't be written.
    """
    check_new(place)
    columns = [f"{name}.{element}" for name, elements in elements_of(run).items() for element in elements]
    tables = [run.log.time[:, None].tolist(), *(table.tolist() for table in run.log.signals.values())]
    with replaced_file(place) as staging, staging.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(["time", *columns])
        for parts in zip(*tables, strict=True):
            writer.writerow([value for part in parts for value in part])


def write_mcap(run: Run, place: Path) -> None:
    """Writes a topic /SIGNAL for each signal, with a JSON message for each tick: a number for each element.

    Times of messages are those of the log, counted from the start of the run. A value that is not finite is null.

    Raises:
        InputError: the extra `export` is not installed.
        RunFolderError: `place` exists, or can't be written.
    """
    try:  # an optional extra
        from mcap.writer import Writer
    except ModuleNotFoundError:
        raise InputError(MISSING_MCAP) from None
    check_new(place)
    named = elements_of(run)
    stamps = [round(time * _NANOSECONDS) for time in run.log.time.tolist()]
    with replaced_file(place) as staging, staging.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="", library="pdhocbf_drake")
        writer.add_metadata("run", {"scenario": run.scenario.name, "ending": run.log.ending})
        channels = {}
        for name, elements in named.items():
            schema = writer.register_schema(name, "jsonschema", json.dumps(_schema(name, elements)).encode())
            channels[name] = writer.register_channel(f"/{name}", "json", schema)
        tables = {name: table.tolist() for name, table in run.log.signals.items()}
        for row, stamp in enumerate(stamps):
            for name, elements in named.items():
                values = (value if math.isfinite(value) else None for value in tables[name][row])
                message = json.dumps(dict(zip(elements, values, strict=True))).encode()
                writer.add_message(channels[name], stamp, message, stamp)
        writer.finish()


def _schema(name: str, elements: tuple[str, ...]) -> dict[str, object]:
    """The JSON schema of a signal's messages."""
    signal = _SIGNALS.get(name)
    about = {} if signal is None else {"description": f"{signal.meaning} [{signal.unit}]"}
    return {
        "title": name, **about, "type": "object",
        "properties": {element: {"type": ["number", "null"]} for element in elements},
    }  # fmt: skip


def check_new(place: Path) -> None:
    """Raises `RunFolderError` where something is there already."""
    if place.exists():
        raise RunFolderError(f"{place} exists already; remove it, or choose another place with --out")
