"""The command `pdhocbf`: runs one verb, and turns errors into one line and an exit code."""

from __future__ import annotations

import argparse
import errno
import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final

import pdhocbf_drake
from pdhocbf_drake.cli.loading import drake_on_demand, load
from pdhocbf_drake.collecting import quick_imports
from pdhocbf_drake.errors import PageWarning, PdhocbfError
from pdhocbf_drake.stopping import interruptible, stop_requests
from pdhocbf_drake.streams import safe_streams
from pdhocbf_drake.terminal import say

_DESCRIPTION = "Periodic safety for walking robots, simulated with Drake."
_CODES = "Exit codes: 0 success; 1 an error, explained in one sentence, or Ctrl-C; 2 wrong usage"
_ENDED_EARLY = "; 3 the run folder is written, but the robot fell or the simulation failed before its end"

# Verb: (its help, the module below this package with its `add_arguments(parser)` and `run(options) -> exit code`).
# Only the module of the given verb is imported, since most of them load Drake.
_VERBS: Final[dict[str, tuple[str, str]]] = {
    "list": ("scenarios that come with the package", "cli.list"),
    "run": ("simulate a scenario and write a run folder", "cli.run"),
    "drive": ("a walk in real time under your controls in a browser, recorded as a run", "cli.drive"),
    "import": (
        "a robot file and a scenario from a URDF, SDF or MJCF file",
        "importing.command",
    ),
    "check": ("whether a robot's file fits its model, and a walk its robot", "cli.check"),
    "compare": ("safety margins of two runs and their ratio (6)", "cli.compare"),
    "delay": ("how late the measurements of a recorded walk are, and how its ZMP lags", "cli.delay"),
    "replay": ("rebuild a run's replay.html from its log", "cli.replay"),
    "report": ("rebuild a run's report.html, or write one page for several runs", "cli.report"),
    "cache": ("compiled programs that are kept between commands: what there is, or delete it", "cli.cache"),
    "export": ("a run's log as CSV and MCAP, for PlotJuggler, Foxglove and others", "cli.export"),
    "certify": ("bounds that can be kept for ever, their cost, and the pushes they allow", "studies.certify.command"),
    "design-bound": ("a certified bound from a recorded walk, as YAML", "studies.certify.design_command"),
    "robust": ("what robustness to disturbances costs and buys", "studies.certify.robust_command"),
    "bench": ("cost of a control tick, beside other ways to solve the same problem", "studies.bench.command"),
    "gait": (
        "what the shape of a gait costs in torque, ZMP, barrier, pushes and certified area",
        "studies.gait.command",
    ),
    "tune": ("the gait that suits a robot and an aim, as a scenario", "studies.tune.command"),
    "worth": ("benefit of a barrier after a disturbance or a change of command", "studies.worth.command"),
    "push": ("the largest push that the robot survives, by direction, phase and barrier", "studies.push.command"),
    "directions": (
        "walks that turn, go sideways, stop and start, beside what they must reach",
        "studies.directions.command",
    ),
    "ground": (
        "walks over stairs, slopes and other uneven ground, beside what they must reach",
        "studies.ground.command",
    ),
    "sensing": (
        "walks with late, noisy and wrong knowledge of the robot, beside what they must reach",
        "studies.sensing.command",
    ),
    "limits": (
        "walks at the limits of joints and ground, beside what they must reach",
        "studies.limits.command",
    ),
    "reproduce": ("every figure and number of the paper beside ours", "studies.reproduce.command"),
    "campaign": ("many runs with fields varied, on all cores or a Dask cluster", "studies.campaign.command"),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns the exit code: 0, 1, 2 or 3, as the help says."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    # More BLAS threads slow small matrices down. NumPy reads this when a verb loads it.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ["MPLBACKEND"] = "agg"  # figures go to files; matplotlib would refuse a name that it does not have
    with safe_streams() as output:
        try:
            with _page_warnings() as missing:
                code = _run(words)
        finally:  # also after the help, which ends the process
            output.flush()
            if output.problem:
                _fail(f"the output cannot be written: {output.problem}")
            elif output.replaced:
                say(f"pdhocbf: the output's encoding, {output.encoding}, lacks some characters, which are shown as ?")
        return code or int(bool(missing or output.problem))


def _run(words: list[str]) -> int:
    try:
        # An import that Ctrl-C interrupts can fail with any exception.
        with stop_requests() as stop, quick_imports():
            parser, used, module = _parser(words)
        if stop.is_set():
            raise KeyboardInterrupt
        options, unknown = parser.parse_known_args(words)
        if unknown:  # printed with the usage of the verb, not with that of all verbs
            used.error(f"unknown here: {' '.join(unknown)}")
        with interruptible():
            return _perform(module, options)
    except PdhocbfError as error:
        return _fail(str(error))
    except KeyboardInterrupt:
        return _fail("interrupted; nothing was written")
    except Exception as error:
        if os.environ.get("PDHOCBF_DEBUG"):
            raise
        if isinstance(error, OSError) and error.errno == errno.ENOSPC:
            return _fail(f"{error.filename or 'a file'} cannot be written: {error.strerror}")
        first = (str(error).splitlines() or ["no message"])[0]
        return _fail(f"unexpected {type(error).__name__}: {first} (set PDHOCBF_DEBUG=1 to see where)")


def _perform(module: Any, options: argparse.Namespace) -> int:
    try:
        with drake_on_demand():
            code: int = module.run(options)
        return code
    except SystemExit as error:  # some of Drake's checks end the process
        if isinstance(error.code, str):
            raise PdhocbfError(f"Drake refuses something in this: {error.code.splitlines()[0]}") from None
        raise


@contextmanager
def _page_warnings() -> Iterator[list[str]]:
    """The pages that could not be made within the block, each said in one sentence."""
    missing: list[str] = []
    with warnings.catch_warnings():
        others: Any = warnings.showwarning

        def show(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
            if issubclass(category, PageWarning):
                missing.append(str(message))
                say(f"pdhocbf: {message}")
            else:
                others(message, category, *place, **more)

        warnings.showwarning = show
        warnings.simplefilter("always", PageWarning)
        yield missing


def _parser(words: Sequence[str]) -> tuple[argparse.ArgumentParser, argparse.ArgumentParser, Any]:
    """The parser, with the arguments of the verb among the words; that verb's parser; and its module."""
    parser = argparse.ArgumentParser(
        prog="pdhocbf", description=_DESCRIPTION, epilog=f"{_CODES}{_ENDED_EARLY} (run, drive)."
    )
    parser.add_argument("--version", action="version", version=f"pdhocbf_drake {pdhocbf_drake.__version__}")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    given = next((word for word in words if not word.startswith("-")), None)
    module, used = None, parser
    for verb, (text, place) in _VERBS.items():
        codes = f"{_CODES}{_ENDED_EARLY if verb in ('run', 'drive') else ''}."
        subparser = verbs.add_parser(verb, help=text, description=f"{text[0].upper()}{text[1:]}.", epilog=codes)
        if verb == given:
            module = load(f"pdhocbf_drake.{place}")
            module.add_arguments(subparser)
            used = subparser
    return parser, used, module


def _fail(message: str) -> int:
    say(f"pdhocbf: {message}")
    return 1
