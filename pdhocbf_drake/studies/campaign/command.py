"""`pdhocbf campaign`: a campaign goes in, a folder with a table, a summary and a report comes out."""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path
from typing import Any, Final

from pdhocbf_drake.errors import InputError, PdhocbfError, RunFolderError
from pdhocbf_drake.simulation.run_folder import REPORT, replaced_file
from pdhocbf_drake.stopping import stop_requests
from pdhocbf_drake.studies.campaign.config import CampaignConfig
from pdhocbf_drake.studies.campaign.plan import PlannedRun, check_buildable, load_campaign, plan_runs
from pdhocbf_drake.studies.shared.results import write_json, write_text
from pdhocbf_drake.terminal import say, shown_progress, table
from pdhocbf_drake.yaml_text import write_yaml

SUMMARY: Final = "campaign.json"
CAMPAIGN: Final = "campaign.yaml"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A campaign, its folder, and the workers."""
    parser.add_argument("campaign", metavar="FILE", help="a YAML file, or a campaign that comes with the package")
    parser.add_argument("--out", type=Path, metavar="DIR", help="the folder; otherwise ./runs/campaign-NAME")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="a Dask scheduler to use, such as tcp://host:8786")
    parser.add_argument("--workers", type=int, metavar="N", help="workers on this machine; otherwise one a core")
    parser.add_argument("--retry-failed", action="store_true", help="run those again that failed before")


def run(options: argparse.Namespace) -> int:
    """Runs the missing runs of a campaign; returns the exit code."""
    try:  # imports in functions of this module are for start-up time, and here since the packages are an extra
        from pdhocbf_drake.studies.campaign.store import FAILED, CampaignStore, locked
    except ModuleNotFoundError as error:
        raise InputError(
            f"a campaign needs the package '{error.name}'; install them all with pip install 'pdhocbf-drake[campaign]'"
        ) from None
    if options.workers is not None and options.workers < 1:
        raise InputError(f"--workers must be 1 or more, given {options.workers}")
    if options.workers is not None and options.scheduler is not None:
        raise InputError("--workers is for this machine; a scheduler has the workers that it has")
    config, path = load_campaign(options.campaign)
    planned = plan_runs(config, path.resolve().parent)
    folder: Path = options.out or Path("runs") / f"campaign-{path.stem}"
    with locked(folder):
        store = CampaignStore(folder, planned)
        if options.retry_failed:
            store.forget([number for number, row in store.rows.items() if row["status"] == FAILED])
        if not store.rows:
            check_buildable(planned)
        with replaced_file(folder / CAMPAIGN) as staging:
            write_yaml(config.model_dump(mode="json"), staging)
        stopped = _run_missing(options, config, path.stem, planned, store)
        rows = [store.rows[number] for number in sorted(store.rows)]
        from pdhocbf_drake.studies.campaign.report import campaign_report
        from pdhocbf_drake.studies.campaign.survival import campaign_summary

        summary = campaign_summary(len(planned), list(config.barriers), rows)
        try:
            store.consolidate()
            write_json(folder / SUMMARY, summary, indent=2)
            write_text(folder / REPORT, campaign_report(path.stem, config, len(planned), rows))
        except RunFolderError as error:
            stopped = stopped or str(error)
    _print(summary, folder)
    if stopped:
        again = "the same command goes on from there" if len(rows) < len(planned) else "the same command completes it"
        say(f"pdhocbf: {stopped}; {len(rows)} of {len(planned)} runs are kept, and {again}")
        return 1
    return 0


def _run_missing(
    options: argparse.Namespace, config: CampaignConfig, name: str, planned: list[PlannedRun], store: Any
) -> str:
    """Runs the runs without a row and writes each row; returns the reason of an early stop, otherwise ""."""
    from pdhocbf_drake.studies.campaign.cluster import cores, existing_cluster, local_cluster
    from pdhocbf_drake.studies.campaign.dispatch import dispatch

    missing = [run for run in planned if run.run not in store.rows]
    if not missing:
        return ""
    try:
        where = existing_cluster(options.scheduler) if options.scheduler else local_cluster(options.workers or cores())
        shown = shown_progress(name, len(planned), "runs", len(store.rows))
        with where as client, stop_requests() as asked, shown as progress:
            for outcome in dispatch(client, missing, config.run_seconds):
                if asked.is_set():
                    return "interrupted"
                if outcome is not None:
                    store.add(outcome)
                    counts = Counter(row["status"] for row in store.rows.values())
                    words = (f"{count} {status}" for status, count in sorted(counts.items(), reverse=True))
                    progress(len(store.rows), ", ".join(words))
    except KeyboardInterrupt:
        return "interrupted"
    except PdhocbfError as error:
        if not store.rows:
            raise
        return str(error)
    return ""


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
    print(f"results: {folder}")
