"""Processes of runs that are forked from a prepared one: the same results, and nothing that stays behind."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
import psutil
import pytest
from campaigns import TINY, campaign_file

from pdhocbf_drake.kept import Kept
from pdhocbf_drake.mpc.loop import walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.simulation.build import WalkParts, build_walk
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.campaign import task
from pdhocbf_drake.studies.campaign.pace import Pace
from pdhocbf_drake.studies.campaign.plan import PlannedRun, load_campaign, plan_runs

TIMES = ("wall_seconds", "real_time_factor", "tick_seconds_median", "tick_seconds_p99")


def planned(folder: Path, **changes: object) -> list[PlannedRun]:
    config, path = load_campaign(str(campaign_file(folder, **changes)))
    return plan_runs(config, path.parent)


def without_times(metrics: object) -> object:
    if isinstance(metrics, dict):
        return {name: without_times(value) for name, value in metrics.items() if name not in TIMES}
    return metrics


def prepared_processes() -> list[psutil.Process]:
    """Those of `one_run` that this process has."""
    word = "pdhocbf_drake.studies.campaign.one_run"
    return [child for child in psutil.Process().children() if word in child.cmdline()]


def test_a_forked_run_has_the_results_of_one_in_a_process_of_its_own(tmp_path, monkeypatch) -> None:
    """Bit for bit, whatever was run before it in the same place; one that can't be built says the same too."""
    hard = {**TINY["overrides"], "pushes": [{"time": 0.1, "force": [0.0, 0.0, 0.0], "duration": 0.1}], "duration": 2.0}
    factors = {
        "pushes.0.force.0": {"values": [-300.0, 10.0]},
        "gait.stride": {"values": [0.02, 0.03]},
        "barriers.speed.bound.value": {"values": [3.0, -1.0]},
    }
    runs = planned(tmp_path, overrides=hard, runs=None, sample="grid", factors=factors)[::3]  # of each value some
    for factor, values in factors.items():
        assert {run.factors[factor] for run in runs} >= set(values["values"])
    forked = [task.run_process(run.run, run.scenario, 100.0) for run in runs]
    monkeypatch.setattr(task, "can_fork", lambda: False)
    alone = [task.run_process(run.run, run.scenario, 100.0) for run in runs]
    assert {"fell", None} < {answer.get("status") for answer in forked}
    for one, other in zip(forked, alone, strict=True):
        assert one.get("status") == other.get("status")
        assert one.get("error") == other.get("error")
        assert without_times(one.get("metrics")) == without_times(other.get("metrics"))


def test_the_prepared_process_has_one_thread_serves_many_runs_and_keeps_nothing_of_them(tmp_path) -> None:
    runs = planned(tmp_path, runs=4)
    for run in runs[:2]:  # both barriers
        task.run_process(run.run, run.scenario, 100.0)
    [process] = prepared_processes()
    files, memory = process.num_fds(), process.memory_info().rss
    for _ in range(5):
        for run in runs:
            assert "status" in task.run_process(run.run, run.scenario, 100.0)
    assert prepared_processes() == [process]
    assert process.num_threads() == 1
    assert process.num_fds() == files
    assert process.memory_info().rss < memory + 20e6
    assert not process.children()


def test_a_stopped_run_leaves_the_prepared_process_ready(tmp_path) -> None:
    run = planned(tmp_path)[0]
    task.run_process(0, run.scenario, 100.0)
    [process] = prepared_processes()
    long = {**run.scenario, "duration": 3000.0}
    started = time.monotonic()
    assert task.run_process(1, long, 1.5) == {"error": "gave no answer in 1.5 s"}
    assert time.monotonic() - started < 10.0
    assert not process.children()
    assert "status" in task.run_process(2, run.scenario, 100.0)
    assert prepared_processes() == [process]


def test_a_prepared_process_that_died_is_replaced(tmp_path) -> None:
    run = planned(tmp_path)[0]
    task.run_process(0, run.scenario, 100.0)
    [process] = prepared_processes()
    process.kill()
    while process.status() != psutil.STATUS_ZOMBIE:
        time.sleep(0.01)
    assert task.run_process(1, run.scenario, 100.0) == {"died": "the run's process was ended by SIGKILL"}
    assert "status" in task.run_process(2, run.scenario, 100.0)


@contextmanager
def served(idle: float) -> Iterator[tuple[subprocess.Popen[bytes], Connection]]:
    """A prepared process that ends after `idle` seconds without a run, and the worker's end."""
    ours, theirs = socket.socketpair()
    code = f"from pdhocbf_drake.studies.campaign import one_run; one_run.IDLE = {idle}; one_run.main()"
    with theirs:
        process = subprocess.Popen([sys.executable, "-c", code], stdin=theirs)
    worker = Connection(ours.detach())
    try:
        yield process, worker
    finally:
        worker.close()
        process.kill()
        process.wait()


def test_a_prepared_process_ends_by_itself_when_there_is_nothing_to_do(tmp_path) -> None:
    with served(idle=0.2) as (process, worker):
        worker.send_bytes(b"")  # stops a run that has just ended
        assert process.wait(timeout=60.0) == 0
        with pytest.raises((EOFError, ConnectionResetError)):
            worker.recv_bytes()


def test_a_run_ends_with_the_worker(tmp_path) -> None:
    scenario = {**planned(tmp_path)[0].scenario, "duration": 3000.0}
    with served(idle=60.0) as (process, worker):
        worker.send_bytes(json.dumps({"run": 0, "scenario": scenario, "fork": True}).encode())
        end = time.monotonic() + 60.0
        while not (below := psutil.Process(process.pid).children()) and time.monotonic() < end:
            time.sleep(0.05)
        worker.close()
        assert process.wait(timeout=10.0) == 0
        psutil.wait_procs(below, timeout=10.0)
        assert below
        assert not any(child.is_running() for child in below)


def test_walks_with_parts_in_common_plan_bit_for_bit_the_same() -> None:
    texts = ["", "barriers: {forward_speed: {gamma: [0.2, 0.2]}}", "barriers: {forward_speed: null}", ""]
    scenarios = [load_scenario("vhip", f"{{gait: {{ticks_per_step: 20, tick: 0.02}}, mpc: {{horizon: 40}}, {text}}}")
                 for text in texts]  # fmt: skip
    parts = WalkParts(most=3)
    for scenario in scenarios:
        for common in (None, parts):
            mpc = build_walk(scenario, common).mpc
            rows = list(walk_template(mpc, Memory.standing(mpc), 0, 100, np.array([[0.0, 0.0]] * 90 + [[0.3, 0.1]])))
            states = np.array([row.state for row in rows])
            if common is None:
                alone = states
        np.testing.assert_array_equal(states, alone)


def test_the_last_things_asked_for_are_kept() -> None:
    made: list[int] = []

    def get(key: int) -> int:
        return kept.get(key, lambda: made.append(key) or key)  # type: ignore[func-returns-value]

    kept = Kept[int](most=2)
    assert [get(key) for key in (1, 2, 1, 3, 1, 2)] == [1, 2, 1, 3, 1, 2]
    assert made == [1, 2, 3, 2]
    assert len(kept) == 2


def test_the_pace_is_the_simulated_share_of_the_workers_time(monkeypatch) -> None:
    clock = iter([100.0, 104.0, 110.0, 999.0])
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    pace = Pace(2)
    pace.row(6.0)
    pace.row(5.0)
    assert pace.summary() == {
        "seconds": 10.0, "workers": 2, "simulating_seconds": 11.0, "simulating_share": 0.55,
    }  # fmt: skip
    assert Pace(2).summary()["simulating_share"] is None


def test_scenarios_of_planned_runs_are_those_that_were_checked(tmp_path) -> None:
    for run in planned(tmp_path, runs=6):
        assert Scenario.from_dict(run.scenario, "again").to_dict() == run.scenario
        assert run.scenario["seed"] == run.seed
        assert run.scenario["pushes"][0]["force"][0] == run.factors["pushes.0.force.0"]
