"""Command-line arguments of several commands."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any


def add_scenario(parser: argparse.ArgumentParser, note: str = "") -> None:
    """Adds the scenario that is to be studied, and `--text`."""
    help_text = f"a name from `pdhocbf list`, or FILE[:NAME]{note}"
    parser.add_argument("scenario", metavar="SCENARIO", help=help_text)
    add_overrides(parser)


def add_work(parser: argparse.ArgumentParser, verb: str) -> None:
    """Adds the number of processes, and the folder of the results."""
    parser.add_argument("--workers", type=int, default=2, metavar="N", help="processes")
    parser.add_argument("--out", type=Path, metavar="DIR", help=f"the folder; otherwise ./runs/{verb}-NAME")


def add_overrides(parser: argparse.ArgumentParser) -> None:
    """Adds `--text YAML`, which may be given once."""
    text = "overrides, such as 'gait: {stride: 0.1}, duration: 5'"
    parser.add_argument("--text", default="", metavar="YAML", action=_Once, help=text)


def add_from_time(parser: argparse.ArgumentParser, help_text: str) -> None:
    """Adds `--from-time S`, a finite time from 0 s on."""
    parser.add_argument("--from-time", type=_seconds, metavar="S", help=help_text)


def _seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0.0 <= value < math.inf:
        raise argparse.ArgumentTypeError(f"a time from 0 s on is needed, given {text}")
    return value


class _Once(argparse.Action):
    """Stores a value; a second one is an error, since the first one would be lost."""

    def __call__(self, parser: argparse.ArgumentParser, options: argparse.Namespace, value: Any, *_: Any) -> None:
        if getattr(options, self.dest) != self.default:
            parser.error(f"{self.option_strings[0]} is given twice; put all of it into one, such as 'a: 1, b: 2'")
        setattr(options, self.dest, value)
