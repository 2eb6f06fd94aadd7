"""Command-line arguments of several commands."""

from __future__ import annotations

import argparse
from typing import Any


def add_overrides(parser: argparse.ArgumentParser) -> None:
    """Adds `--text YAML`, which may be given once."""
    text = "overrides, such as 'gait: {stride: 0.1}'"
    parser.add_argument("--text", default="", metavar="YAML", action=_Once, help=text)


class _Once(argparse.Action):
    """Stores a value; a second one is an error, since the first one would be lost."""

    def __call__(self, parser: argparse.ArgumentParser, options: argparse.Namespace, value: Any, *_: Any) -> None:
        if getattr(options, self.dest) != self.default:
            parser.error(f"{self.option_strings[0]} is given twice; put all of it into one, such as '{{a: 1, b: 2}}'")
        setattr(options, self.dest, value)
