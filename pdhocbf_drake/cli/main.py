"""Reads the command line, runs one verb, and turns what goes wrong into one line and an exit code.

Exit codes: 0 fine, 1 an error or an interruption, told without a traceback, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

import pdhocbf_drake
from pdhocbf_drake.errors import PdhocbfError

_DESCRIPTION = "Periodic safety for walking robots, simulated with Drake."
_SCENARIO = "a name from `pdhocbf list`, or a YAML file, or FILE:NAME for one of several in a file"


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line; gives the exit code."""
    options = _parser().parse_args(arguments)
    try:
        return _run_verb(options)
    except PdhocbfError as error:
        return _fail(str(error))
    except KeyboardInterrupt:
        return _fail("interrupted; nothing was written")
    except BrokenPipeError:
        # Whoever read our output has closed it; Python would complain once more when it flushes.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Exception as error:
        if os.environ.get("PDHOCBF_DEBUG"):
            raise
        first = (str(error).splitlines() or ["no message"])[0]
        return _fail(f"unexpected {type(error).__name__}: {first} (set PDHOCBF_DEBUG=1 to see where)")


def _run_verb(options: argparse.Namespace) -> int:
    # Imported here, because the verbs load Drake, and usage errors need not wait for that.
    from pdhocbf_drake.campaign import command as campaign
    from pdhocbf_drake.cli import inspect, run

    if options.verb == "list":
        return inspect.list_scenarios()
    if options.verb == "run":
        return run.run(options.scenario, options.text, options.out, options.meshcat, not options.no_replay)
    if options.verb == "compare":
        return inspect.compare_runs(options.first, options.second, options.from_time)
    if options.verb == "replay":
        return inspect.replay(options.run)
    if options.verb == "campaign":
        return campaign.run(options)
    return inspect.report(options.runs, options.out)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="pdhocbf", description=_DESCRIPTION)
    parser.add_argument("--version", action="version", version=f"pdhocbf_drake {pdhocbf_drake.__version__}")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")

    verbs.add_parser("list", help="scenarios that come with the package")

    run = verbs.add_parser("run", help="simulate a scenario and write a run folder")
    run.add_argument("scenario", metavar="SCENARIO", help=_SCENARIO)
    run.add_argument("--text", default="", metavar="YAML", help="overrides, such as 'gait: {stride: 0.1}'")
    run.add_argument("--out", type=Path, metavar="DIR", help="the run folder; otherwise a new one in ./runs")
    run.add_argument("--meshcat", action="store_true", help="show the run live in a browser")
    run.add_argument("--no-replay", action="store_true", help="leave replay.html out")

    compare = verbs.add_parser("compare", help="safety margins of two runs and their ratio (6)")
    compare.add_argument("first", type=Path, metavar="RUN")
    compare.add_argument("second", type=Path, metavar="RUN")
    compare.add_argument(
        "--from-time", type=_seconds, default=2.0, metavar="S", help="start of the steady state [s], 2.0 unless told"
    )

    replay = verbs.add_parser("replay", help="rebuild a run's replay.html from its log")
    replay.add_argument("run", type=Path, metavar="RUN")

    report = verbs.add_parser("report", help="rebuild a run's report.html, or write one page for several runs")
    report.add_argument("runs", type=Path, nargs="+", metavar="RUN")
    report.add_argument("--out", type=Path, metavar="FILE", help="where to write it; ./comparison.html for several")

    campaign = verbs.add_parser("campaign", help="many runs with fields varied, on all cores or a Dask cluster")
    campaign.add_argument("campaign", metavar="FILE", help="a YAML file, or a campaign that comes with the package")
    campaign.add_argument("--out", type=Path, metavar="DIR", help="the folder; otherwise ./runs/campaign-NAME")
    campaign.add_argument("--scheduler", metavar="ADDRESS", help="a Dask scheduler to use, such as tcp://host:8786")
    campaign.add_argument("--workers", type=int, metavar="N", help="workers on this machine; otherwise one a core")
    campaign.add_argument("--retry-failed", action="store_true", help="run those again that failed before")
    return parser


def _seconds(text: str) -> float:
    value = float(text)
    if not 0.0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"a time from 0 s on is needed, given {text}")
    return value


def _fail(message: str) -> int:
    print(f"pdhocbf: {message}", file=sys.stderr)
    return 1
