"""The study of many runs as a function: a campaign goes in, a folder with a table, a summary and a report comes out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from pdhocbf_drake.errors import InputError, PdhocbfError, RunFolderError
from pdhocbf_drake.files.file import replaced_file, write_text
from pdhocbf_drake.files.pages import page
from pdhocbf_drake.simulation.run_folder import REPORT
from pdhocbf_drake.stopping import stop_requests
from pdhocbf_drake.studies.campaign.config import CampaignConfig
from pdhocbf_drake.studies.campaign.pace import Pace
from pdhocbf_drake.studies.campaign.plan import PlannedRun, check_buildable, load_campaign, plan_runs
from pdhocbf_drake.studies.shared.pool import check_workers
from pdhocbf_drake.studies.shared.results import write_json
from pdhocbf_drake.yaml_text import write_yaml

Report = Callable[[int, int, str], None]


class CampaignResult(NamedTuple):
    """The results of a campaign.

    Attributes:
        folder: the folder of its files.
        summary: the content of campaign.json, see docs/campaigns.md.
        rows: the rows of runs.parquet, one for each run that has ended.
        stopped: why it stopped before all runs had ended or been written; empty if it did not.
    """

    folder: Path
    summary: dict[str, Any]
    rows: list[dict[str, Any]]
    stopped: str


def campaign(
    file: str | Path,
    *,
    out: str | Path | None = None,
    seed: int | None = None,
    runs: int | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    retry_failed: bool = False,
    progress: Report = lambda done, total, words: None,
    checked: Callable[[int, int], None] = lambda done, total: None,
) -> CampaignResult:
    """Runs what is missing of a campaign, as `pdhocbf campaign` does; the calling script needs
    `if __name__ == "__main__":`, since its workers are processes.

    Args:
        file: a YAML file, or the name of a campaign that comes with the package.
        out: the folder; by default ./runs/campaign-NAME, with a seed ./runs/campaign-NAME-seed-SEED. Runs whose results
            it holds are not run again.
        seed, runs: replace those of the file.
        workers: processes on this machine; by default one a core.
        scheduler: address of a Dask scheduler whose workers are used instead, such as tcp://host:8786.
        retry_failed: run those again that failed before.
        progress: called with the number of runs that have ended, that of all runs, and how many ended in which way.
        checked: called before, now and then, with the number of runs whose scenario is checked, and that of all runs.

    Raises:
        InputError: the campaign or an argument can't be used, or the extra `campaign` is not installed.
        ModelError: its robot can't be loaded. ClusterError: the scheduler or its workers can't be used.
        RunFolderError: the folder can't be written, or holds another campaign.
    """
    if workers is not None:
        check_workers(workers)
        if scheduler is not None:
            raise InputError("workers are for this machine; a scheduler has its own")
    config, path = load_campaign(str(file), seed=seed, runs=runs)
    planned = plan_runs(config, path.resolve().parent, checked)
    try:  # an optional extra, loaded once all that is given has been checked
        from pdhocbf_drake.studies.campaign.store import CAMPAIGN, FAILED, CampaignStore, locked
        from pdhocbf_drake.studies.campaign.survival import campaign_summary
    except ModuleNotFoundError as error:
        raise InputError(
            f"a campaign needs the package '{error.name}'; "
            "install them all with pip install '.[campaign]' in this package's repository"
        ) from None
    name = path.stem if seed is None else f"{path.stem}-seed-{seed}"
    folder = Path("runs") / f"campaign-{name}" if out is None else Path(out)
    with locked(folder):
        store = CampaignStore(folder, planned)
        if retry_failed:
            store.forget([number for number, row in store.rows.items() if row["status"] == FAILED])
        if not store.rows:
            check_buildable(planned)
        kept = folder / CAMPAIGN
        if not (kept.exists() and kept.samefile(path)):  # a user's own file keeps its words
            with replaced_file(kept) as staging:
                write_yaml(config.model_dump(mode="json"), staging)
        missing = [run for run in planned if run.run not in store.rows]
        stopped, pace = _run(config, missing, store, workers, scheduler, progress) if missing else ("", store.pace())
        rows = [store.rows[number] for number in sorted(store.rows)]
        summary = campaign_summary(len(planned), list(config.barriers), rows) | pace
        try:
            store.consolidate()
            _write_results(folder, path.stem, config, summary, rows)
        except RunFolderError as error:
            stopped = stopped or str(error)
    return CampaignResult(folder, summary, rows, stopped)


def _run(
    config: CampaignConfig,
    missing: list[PlannedRun],
    store: Any,
    workers: int | None,
    scheduler: str | None,
    progress: Report,
) -> tuple[str, dict[str, Any]]:
    """Runs the runs and writes each row; returns the reason of an early stop, or nothing, and the pace."""
    # The extra `campaign`, whose absence `campaign` reports.
    from pdhocbf_drake.studies.campaign.cluster import cores, existing_cluster, local_cluster, threads
    from pdhocbf_drake.studies.campaign.dispatch import dispatch

    total, pace, stopped = len(store.rows) + len(missing), Pace(0), ""
    endings = Counter(row["status"] for row in store.rows.values())
    try:
        here = workers or cores()
        where = existing_cluster(scheduler) if scheduler else local_cluster(here)
        with where as client, stop_requests() as asked:
            progress(len(store.rows), total, "")
            pace = Pace(threads(client) if scheduler else here)
            for outcome in dispatch(client, missing, config.run_seconds):
                if asked.is_set():
                    return "interrupted", pace.summary()
                if outcome is not None:
                    endings[store.add(outcome)["status"]] += 1
                    pace.row(outcome.simulating)
                    progress(len(store.rows), total, _words(endings))
    except KeyboardInterrupt:
        stopped = "interrupted"
    except PdhocbfError as error:
        if not store.rows:
            raise
        stopped = str(error)
    return stopped, pace.summary()


def _words(endings: Counter[str]) -> str:
    return ", ".join(f"{count} {status}" for status, count in sorted(endings.items(), reverse=True))


def _write_results(
    folder: Path, name: str, config: CampaignConfig, summary: dict[str, Any], rows: list[dict[str, Any]]
) -> None:
    # The extra `campaign`, whose absence `campaign` reports.
    from pdhocbf_drake.studies.campaign.report import campaign_report
    from pdhocbf_drake.studies.campaign.store import SUMMARY

    write_json(folder / SUMMARY, summary, indent=2)
    with page(REPORT):
        write_text(folder / REPORT, campaign_report(name, config, summary["runs"], rows))
