"""Reads the command line, runs one verb, and turns what goes wrong into one line and an exit code.

Exit codes: 0 fine, 1 an error or an interruption, told without a traceback, 2 wrong usage, 3 a run that ended early.
"""

from __future__ import annotations

import argparse
import errno
import os
import sys
from collections.abc import Sequence
from typing import Any, Final

import pdhocbf_drake
from pdhocbf_drake.cli.loading import load
from pdhocbf_drake.errors import PdhocbfError
from pdhocbf_drake.stopping import stop_requests

_DESCRIPTION = "Periodic safety for walking robots, simulated with Drake."
_CODES = (
    "Exit codes: 0 fine; 1 an error, told in one sentence, or Ctrl-C; 2 wrong usage; 3 `run` simulated and wrote its "
    "run folder, but the robot fell or the simulation gave up before the scenario's duration."
)

# Verb: (what it does, the module below this package with its `add_arguments(parser)` and `run(options) -> exit code`).
# Only the module of the verb that is asked for is imported, since most of them load Drake.
_VERBS: Final[dict[str, tuple[str, str]]] = {
    "list": ("scenarios that come with the package", "cli.list"),
    "run": ("simulate a scenario and write a run folder", "cli.run"),
    "compare": ("safety margins of two runs and their ratio (6)", "cli.compare"),
    "replay": ("rebuild a run's replay.html from its log", "cli.replay"),
    "report": ("rebuild a run's report.html, or write one page for several runs", "cli.report"),
    "certify": (
        "which bounds can be kept for ever, what they cost, and what a push may do",
        "studies.certify.command",
    ),
    "design-bound": ("a certified bound from a recorded walk, as YAML", "studies.certify.design_command"),
    "bench": ("what a control tick costs, against other ways to solve the same problem", "studies.bench.command"),
    "worth": ("what a barrier buys when something goes wrong", "studies.worth.command"),
    "push": ("how hard the robot can be pushed, by direction, phase and barrier", "studies.push.command"),
    "reproduce": ("every figure and number of the paper beside ours", "studies.reproduce.command"),
    "campaign": ("many runs with fields varied, on all cores or a Dask cluster", "studies.campaign.command"),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line; gives the exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    # Small matrices: more BLAS threads only get in each other's way. NumPy reads this when a verb loads it.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        with stop_requests() as asked:  # an import that Ctrl-C cuts in two fails with whatever it was at
            parser, used, module = _parser(words)
        if asked.is_set():
            raise KeyboardInterrupt
        options, unknown = parser.parse_known_args(words)
        if unknown:  # told with the usage of the verb, not with that of all verbs
            used.error(f"unknown here: {' '.join(unknown)}")
        code = _run(module, options)
        sys.stdout.flush()
        return code
    except PdhocbfError as error:
        return _fail(str(error))
    except KeyboardInterrupt:
        return _fail("interrupted; nothing was written")
    except BrokenPipeError:
        # Whoever read our output has closed it.
        _close_output()
        return 1
    except Exception as error:
        if os.environ.get("PDHOCBF_DEBUG"):
            raise
        if isinstance(error, OSError) and error.errno == errno.ENOSPC:
            _close_output()
            return _fail(f"{error.filename or 'the output'} cannot be written: {error.strerror}")
        first = (str(error).splitlines() or ["no message"])[0]
        return _fail(f"unexpected {type(error).__name__}: {first} (set PDHOCBF_DEBUG=1 to see where)")


def _run(module: Any, options: argparse.Namespace) -> int:
    load("pydrake")
    try:
        code: int = module.run(options)
        return code
    except SystemExit as error:
        # Some of Drake's checks end the process, whatever they were asked by.
        if isinstance(error.code, str):
            raise PdhocbfError(f"Drake refuses something in this: {error.code.splitlines()[0]}") from None
        raise


def _close_output() -> None:
    """Python flushes its output once more at its end, and would complain once more."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _parser(words: Sequence[str]) -> tuple[argparse.ArgumentParser, argparse.ArgumentParser, Any]:
    """The parser, complete for the verb among the words, that verb's own parser, and its module."""
    parser = argparse.ArgumentParser(prog="pdhocbf", description=_DESCRIPTION, epilog=_CODES)
    parser.add_argument("--version", action="version", version=f"pdhocbf_drake {pdhocbf_drake.__version__}")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    asked = next((word for word in words if not word.startswith("-")), None)
    module, used = None, parser
    for verb, (what, place) in _VERBS.items():
        subparser = verbs.add_parser(verb, help=what, description=f"{what[0].upper()}{what[1:]}.", epilog=_CODES)
        if verb == asked:
            module = load(f"pdhocbf_drake.{place}")
            module.add_arguments(subparser)
            used = subparser
    return parser, used, module


def _fail(message: str) -> int:
    print(f"pdhocbf: {message}", file=sys.stderr)
    return 1
