"""`pdhocbf campaign`: a campaign goes in, a folder with a table, a summary and a report comes out."""

from __future__ import annotations

import argparse
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Final

from pdhocbf_drake.simulation.run_folder import REPORT
from pdhocbf_drake.studies.campaign.study import campaign
from pdhocbf_drake.terminal import Progress, say, shown_progress, table

_MANY: Final = 10_000  # runs, whose scenarios take seconds to check


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A campaign, its folder, and the workers."""
    parser.add_argument("campaign", metavar="FILE", help="a YAML file, or a campaign that comes with the package")
    parser.add_argument("--out", type=Path, metavar="DIR", help="the folder; otherwise ./runs/campaign-NAME")
    parser.add_argument("--seed", type=int, metavar="N", help="another sample than the file's, in a folder of its own")
    parser.add_argument("--runs", type=int, metavar="N", help="another number of runs than the file's")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="a Dask scheduler to use, such as tcp://host:8786")
    parser.add_argument("--workers", type=int, metavar="N", help="workers on this machine; otherwise one a core")
    parser.add_argument("--retry-failed", action="store_true", help="run those again that failed before")


def run(options: argparse.Namespace) -> int:
    """Runs the missing runs of a campaign; returns the exit code."""
    with ExitStack() as stack, ExitStack() as before:
        shown: Progress | None = None
        checking: Progress | None = None

        def checked(done: int, total: int) -> None:
            nonlocal checking
            if total < _MANY:
                return
            if checking is None:
                checking = before.enter_context(shown_progress("checking", total, "scenarios"))
            checking(done)

        def progress(done: int, total: int, words: str) -> None:
            nonlocal shown
            before.close()
            if shown is None:  # the first call comes before the first run has ended
                shown = stack.enter_context(shown_progress(Path(options.campaign).stem, total, "runs", done))
            else:
                shown(done, words)

        result = campaign(
            options.campaign, out=options.out, seed=options.seed, runs=options.runs, workers=options.workers,
            scheduler=options.scheduler, retry_failed=options.retry_failed, progress=progress, checked=checked,
        )  # fmt: skip
    _print(result.summary, result.folder)
    if result.stopped:
        ended, runs = len(result.rows), result.summary["runs"]
        again = "the same command goes on from there" if ended < runs else "the same command completes it"
        say(f"pdhocbf: {result.stopped}; {ended} of {runs} runs are kept, and {again}")
        return 1
    return 0


def _print(summary: dict[str, Any], folder: Path) -> None:
    cells = [
        (name, f"{100 * rate['rate']:.1f} %", f"{100 * rate['low']:.1f} to {100 * rate['high']:.1f} % of {rate['n']}")
        if rate["n"]
        else (name, "–", "")
        for name, rate in summary["survival"].items()
    ]
    print(table(cells, ("barrier", "survived", "95 % interval")))
    if summary["failed"]:
        print(f"failed: {summary['failed']} runs, each explained in the report")
    print(f"results: {folder}" + (f"; read {folder / REPORT}" if (folder / REPORT).exists() else ""))
