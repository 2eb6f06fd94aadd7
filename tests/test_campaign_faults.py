"""Faults in a campaign: killed processes, a killed command, a full or read-only folder, a lost cluster."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
import pyarrow.parquet as pq
import pytest
from campaigns import TINY, campaign_file, finish, start

from pdhocbf_drake.studies.campaign.task import run_process


def table(folder: Path) -> dict[int, dict]:
    return {row["run"]: row for row in pq.read_table(folder / "runs.parquet").to_pylist()}


def run_processes(root: psutil.Process, run: int | None = None) -> list[psutil.Process]:
    """The processes of runs below a process, or of one run."""
    found = []
    for process in root.children(recursive=True):
        try:
            name = process.name()
        except psutil.Error:
            continue
        if name.startswith("run-") if run is None else name == f"run-{run}":
            found.append(process)
    return found


def slow_campaign(folder: Path, runs: int) -> Path:
    """A campaign whose runs take a second or more, so that they can be caught."""
    return campaign_file(folder, runs=runs, overrides={**TINY["overrides"], "duration": 30.0})


def until(something: Callable[[], object], seconds: float = 120.0) -> object:
    """Waits for something that is true."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if result := something():
            return result
        time.sleep(0.01)
    raise AssertionError("the condition was not met in time")


def test_a_run_whose_process_is_killed_is_begun_once_more(tmp_path) -> None:
    """One run's process is killed once, another one's each time, and for two more what is above it: the process that
    forked it, and that one's worker."""
    command = start("campaign", slow_campaign(tmp_path, 9), "--out", tmp_path / "out", "--workers", 2)
    root = psutil.Process(command.pid)
    until(lambda: run_processes(root, 0))[0].kill()
    first = until(lambda: run_processes(root, 1))[0]
    first.kill()
    until(lambda: [p for p in run_processes(root, 1) if p.pid != first.pid])[0].kill()
    until(lambda: (tmp_path / "out" / "parts" / "run-000001.parquet").exists())
    until(lambda: run_processes(root, 5))[0].parent().kill()
    orphan = until(lambda: run_processes(root, 7))[0]
    orphan.parent().parent().kill()
    orphan.wait(timeout=10)  # a run ends with its worker
    code, out, err = finish(command)
    assert code == 0, err
    assert "failed: 1 runs" in out
    rows = table(tmp_path / "out")
    assert sorted(rows) == list(range(9))
    assert [run for run, row in rows.items() if row["status"] == "failed"] == [1]
    assert [rows[run]["attempts"] for run in (0, 1, 5, 7)] == [2, 2, 2, 2]
    assert rows[1]["error"] == "the run's process was ended by SIGKILL, 2 times"
    summary = json.loads((tmp_path / "out" / "campaign.json").read_text())
    assert (summary["runs"], summary["succeeded"], summary["failed"]) == (9, 8, 1)

    assert summary["workers"] == 2
    assert summary["simulating_share"] == summary["simulating_seconds"] / (2 * summary["seconds"])
    assert 0.0 < summary["simulating_share"] < 1.0

    # What failed is run again only on demand.
    code, out, err = finish(start("campaign", tmp_path / "tiny.yaml", "--out", tmp_path / "out"))
    assert code == 0, err
    assert "failed: 1 runs" in out, err
    assert json.loads((tmp_path / "out" / "campaign.json").read_text()) == summary
    code, out, err = finish(start("campaign", tmp_path / "tiny.yaml", "--out", tmp_path / "out", "--retry-failed"))
    assert code == 0, err
    assert "failed" not in out, err
    assert table(tmp_path / "out")[1]["status"] != "failed"


def test_a_killed_command_leaves_no_process_and_can_be_continued(tmp_path) -> None:
    out = tmp_path / "out"
    command = start("campaign", slow_campaign(tmp_path, 5), "--out", out, "--workers", 2)
    until(lambda: len(list((out / "parts").glob("run-*"))) >= 2 if (out / "parts").is_dir() else False)
    below = psutil.Process(command.pid).children(recursive=True)
    command.kill()
    command.communicate()
    _, alive = psutil.wait_procs(below, timeout=20)
    assert not alive
    kept = {path: path.stat().st_mtime_ns for path in (out / "parts").glob("run-*.parquet")}
    assert 2 <= len(kept) < 5
    before = {path.name: pq.read_table(path).to_pylist() for path in kept}

    code, _, err = finish(start("campaign", tmp_path / "tiny.yaml", "--out", out, "--workers", 2))
    assert code == 0, err
    rows = table(out)
    assert sorted(rows) == list(range(5))
    for name, [row] in before.items():
        same = rows[int(name[4:10])]
        assert (same["worker"], same["metrics.wall_seconds"]) == (row["worker"], row["metrics.wall_seconds"])


def test_ctrl_c_keeps_the_ended_runs_and_explains_how_to_continue(tmp_path) -> None:
    out = tmp_path / "out"
    command = start("campaign", slow_campaign(tmp_path, 40), "--out", out, "--workers", 2)
    root = psutil.Process(command.pid)
    # A worker that replaces a dead one must be as deaf to Ctrl-C as the first ones.
    until(lambda: run_processes(root))[0].parent().parent().kill()
    until(lambda: len(list((out / "parts").glob("run-*"))) > 2 if (out / "parts").is_dir() else False)
    os.killpg(command.pid, signal.SIGINT)  # as a terminal does: to the command and all its workers
    code, _, err = finish(command)
    assert code == 1
    rows = table(out)
    assert 1 <= len(rows) < 40
    assert f"pdhocbf: interrupted; {len(rows)} of 40 runs are kept, and the same command goes on from there" in err
    assert json.loads((out / "campaign.json").read_text())["runs"] == 40
    assert "are still missing" in (out / "report.html").read_text()


def test_a_full_folder_stops_the_campaign_and_keeps_the_written_runs(tmp_path) -> None:
    """A limit on the size of a file stands for the quota: rows still fit, the table of all rows does not."""
    out = tmp_path / "out"
    file = campaign_file(tmp_path, runs=3)
    full = "import resource\nresource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))"
    code, _, err = finish(start("campaign", file, "--out", out, "--workers", 2, preamble=full))
    assert code == 1
    assert "cannot be written: File too large" in err.strip().splitlines()[-1]
    # Room again, and the same command completes it.
    code, _, err = finish(start("campaign", file, "--out", out, "--workers", 2))
    assert code == 0, err
    assert sorted(table(out)) == list(range(3))


@pytest.mark.parametrize("where", ["/proc/campaign", "file/campaign"])
def test_a_folder_that_cannot_be_written_is_refused_before_any_run(tmp_path, where: str) -> None:
    (tmp_path / "file").write_text("")
    place = Path(where) if where.startswith("/") else tmp_path / where
    started = time.monotonic()
    code, _, err = finish(start("campaign", campaign_file(tmp_path), "--out", place))
    assert code == 1
    assert time.monotonic() - started < 20
    assert len(err.strip().splitlines()) == 1
    assert f"pdhocbf: {place} cannot be written: " in err


def test_a_run_without_an_answer_ends_at_its_time_limit(tmp_path) -> None:
    from pdhocbf_drake.studies.campaign.plan import load_campaign, plan_runs

    config, path = load_campaign(str(campaign_file(tmp_path)))
    answer = run_process(0, plan_runs(config, path.parent)[0].scenario, 0.2)
    assert answer == {"error": "gave no answer in 0.2 s"}


@contextmanager
def background(*words: str) -> Iterator[subprocess.Popen[str]]:
    process = subprocess.Popen([sys.executable, "-m", *words], stderr=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


@contextmanager
def dask_cluster(folder: Path) -> Iterator[tuple[str, list[subprocess.Popen[str]]]]:
    """A scheduler and two workers as a user would start them, each a process of its own, on loopback."""
    file = folder / "scheduler.json"
    words = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(file)]
    worker = ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", str(folder)]
    with background("distributed.cli.dask_scheduler", *words):
        address = until(lambda: _address(file))
        with (
            background("distributed.cli.dask_worker", address, *worker) as one,
            background("distributed.cli.dask_worker", address, *worker) as two,
        ):
            yield address, [one, two]


def _address(file: Path) -> str:
    try:
        return json.loads(file.read_text())["address"]
    except (OSError, ValueError):
        return ""


def test_an_existing_cluster_runs_it_and_may_lose_a_worker(tmp_path) -> None:
    with dask_cluster(tmp_path) as (address, workers):
        command = start("campaign", slow_campaign(tmp_path, 4), "--out", tmp_path / "out", "--scheduler", address)
        one = psutil.Process(workers[0].pid)
        until(lambda: run_processes(one))
        lost = run_processes(one)[0]
        run = int(lost.name().removeprefix("run-"))
        one.kill()
        code, _, err = finish(command)
        assert code == 0, err
        lost.wait(timeout=10)  # a run ends with its worker
    rows = table(tmp_path / "out")
    assert sorted(rows) == list(range(4))
    assert not [number for number, row in rows.items() if row["status"] == "failed"]
    assert rows[run]["attempts"] == 2
    assert len({row["worker"] for row in rows.values()}) <= 2


def test_a_lost_scheduler_is_reported_and_the_ended_runs_are_kept(tmp_path) -> None:
    out = tmp_path / "out"
    with dask_cluster(tmp_path) as (address, _):
        command = start("campaign", slow_campaign(tmp_path, 40), "--out", out, "--scheduler", address)
        until(lambda: list((out / "parts").glob("run-*")) if (out / "parts").is_dir() else False)
        [scheduler] = [p for p in psutil.Process().children() if "distributed.cli.dask_scheduler" in p.cmdline()]
        scheduler.kill()
        code, _, err = finish(command)
    assert code == 1
    count = len(table(out))
    assert 1 <= count < 40
    assert f"pdhocbf: the Dask scheduler went away; {count} of 40 runs are kept, and the same command goes on" in err


@pytest.mark.parametrize(
    ("address", "sentence"),
    [
        ("tcp://127.0.0.1:1", "no Dask scheduler answers at tcp://127.0.0.1:1"),
        ("nonsense://x", "--scheduler must be an address such as tcp://host:8786"),
    ],
)
def test_a_missing_cluster_is_reported_in_one_sentence(
    tmp_path, monkeypatch, capsys, address: str, sentence: str
) -> None:
    from pdhocbf_drake.cli import main
    from pdhocbf_drake.studies.campaign import cluster

    monkeypatch.setattr(cluster, "_PATIENCE", 1.0)
    code = main(["campaign", str(campaign_file(tmp_path)), "--out", str(tmp_path / "out"), "--scheduler", address])
    err = capsys.readouterr().err
    assert code == 1
    assert sentence in err
    assert "Traceback" not in err
