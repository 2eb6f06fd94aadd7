"""The studies' shared modules: measures of an event, worker processes, progress and tables, result files."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import psutil
import pytest

from pdhocbf_drake.errors import InputError, PdhocbfError
from pdhocbf_drake.mpc.loop import Measurement, walk_template
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.shared.cases import NONE, PERIODIC, in_case
from pdhocbf_drake.studies.shared.measures import ACTS, Record, SafeOrbit, WithoutBarriers, first_tick
from pdhocbf_drake.studies.shared.pool import in_processes
from pdhocbf_drake.studies.shared.results import write_json
from pdhocbf_drake.studies.shared.template import SettledWalk, settled
from pdhocbf_drake.terminal import shown_progress, table

SHORT = "{gait: {ticks_per_step: 20, tick: 0.02}, mpc: {horizon: 40}}"
MARGIN = 0.0073  # of `vhip` [m/s]


@pytest.fixture(scope="module")
def still() -> Record:
    """A gait at rest."""
    return Record(0, np.zeros((40, 2, 3)), np.zeros((40, 2)), np.zeros((40, 1)), np.zeros(40), np.ones(40, dtype=bool))


@pytest.fixture(scope="module")
def orbit(still: Record) -> SafeOrbit:
    return SafeOrbit(load_scenario("vhip", SHORT), still)


def faster(still: Record, ticks: list[int], by: float) -> Record:
    """The same, with another forward velocity at some ticks."""
    states = still.states.copy()
    states[ticks, 0, 1] += by
    return still._replace(states=states)


def test_first_tick() -> None:
    assert first_tick(np.array([False, True, True])) == 1.0
    assert np.isnan(first_tick(np.zeros(3, dtype=bool)))


def test_ticks_are_counted_from_the_event(orbit: SafeOrbit, still: Record) -> None:
    assert orbit.outcome(faster(still, [0, 2], 0.02), still).recovers == 3.0
    assert orbit.outcome(faster(still, [0, 2], 0.9 * MARGIN), still).recovers == 0.0
    assert np.isnan(orbit.outcome(faster(still, [39], 0.02), still).recovers)


def test_the_excess_is_the_distance_beyond_the_orbit_towards_the_bound(orbit: SafeOrbit, still: Record) -> None:
    assert orbit.outcome(faster(still, [5], 0.02), still).excess == pytest.approx(0.02)
    assert orbit.outcome(faster(still, list(range(40)), -0.02), still).excess == pytest.approx(-0.02)


def test_barriers_act_where_they_do_more_than_in_an_undisturbed_gait(orbit: SafeOrbit, still: Record) -> None:
    usual = still._replace(action=np.full(40, 0.03))
    for extra, tick in ((0.9 * ACTS, np.nan), (1.1 * ACTS, 7.0)):
        action = usual.action.copy()
        action[7] += extra
        np.testing.assert_equal(orbit.outcome(still._replace(action=action), usual).acts, tick)


def test_a_barrier_notices_by_its_own_h(orbit: SafeOrbit, still: Record) -> None:
    h = np.full((40, 2), 1.0)
    h[3, 1], h[4, 1] = -1e-10, -1e-8  # the first is rounding
    assert orbit.outcome(still._replace(h=h), still).notices == 4.0


def test_without_barriers_the_same_controller_plans_the_same_and_so_there_is_no_action() -> None:
    mpc = build_walk(in_case(load_scenario("vhip", SHORT), NONE)).mpc
    free = WithoutBarriers(mpc)
    for row in walk_template(mpc, settled(mpc, 200), 200, 40, np.array([[0.05, 0.02]])):
        assert free.action(row.before, Measurement(row.tick, row.state), row.plan) < 1e-8


def test_the_action_is_the_difference_of_the_planned_zmp_velocities() -> None:
    scenario = load_scenario("vhip", SHORT)
    mpc = build_walk(in_case(scenario, PERIODIC, 0.5)).mpc
    free = WithoutBarriers(build_walk(in_case(scenario, NONE)).mpc)
    (row,) = walk_template(mpc, settled(mpc, 200), 200, 1, np.array([[0.05, 0.0]]))
    assert free.action(row.before, Measurement(row.tick, row.state), row.plan) > 0.1


def test_a_walk_with_an_end_has_no_steady_state_for_events() -> None:
    with pytest.raises(InputError, match="walk without an end"):
        SettledWalk(build_walk(load_scenario("vhip_nobarrier", "gait: {walk_steps: 4}")))


def _square(number: int) -> int:
    return number * number


def _die(number: int) -> int:
    os._exit(1)


def _fail(number: int) -> int:
    raise PdhocbfError(f"no {number}")


@pytest.mark.parametrize("workers", [1, 2])
def test_work_is_shared_and_errors_come_back(workers: int) -> None:
    assert sorted(in_processes(_square, [1, 2, 3], workers)) == [1, 4, 9]
    with pytest.raises(PdhocbfError, match="no 7"):
        list(in_processes(_fail, [7, 7], workers))


def test_workers_end_with_a_killed_command() -> None:
    code = (
        "import sys, time; from pdhocbf_drake.studies.shared.pool import in_processes\n"
        "if __name__ == '__main__': list(in_processes(time.sleep, [0.1, 0.1, 600.0, 600.0], 2))"
    )
    command = subprocess.Popen([sys.executable, "-c", code])
    try:
        own = psutil.Process(command.pid)
        end = time.monotonic() + 60.0
        while len(below := own.children(recursive=True)) < 3 and time.monotonic() < end:
            time.sleep(0.05)
    finally:
        command.kill()
        command.wait()
    _, alive = psutil.wait_procs(below, timeout=20.0)
    assert below
    assert not alive


def test_a_dead_worker_is_reported_in_one_sentence() -> None:
    with pytest.raises(PdhocbfError, match="a worker process died; with --workers 1 everything runs in this one"):
        list(in_processes(_die, [1, 2], 2))


def test_progress_in_lines_has_the_done_amount_and_the_time_left(capsys: pytest.CaptureFixture[str]) -> None:
    with shown_progress("push", 4, "searches", done=1) as progress:
        progress(2, "one more")
        progress(4)
    first, last = capsys.readouterr().err.splitlines()
    assert first.startswith("push: 2 of 4 searches in ")
    assert first.endswith(" s left, one more")
    assert last.startswith("push: 4 of 4 searches in ")
    assert "left" not in last


def test_the_time_left_does_not_count_what_was_needed_before_the_first_of_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    clock = iter([100.0, 120.0, 121.0])
    monkeypatch.setattr("pdhocbf_drake.terminal.time", SimpleNamespace(monotonic=lambda: next(clock)))
    with shown_progress("walk", 10.0, "s simulated") as progress:
        progress(0.0)
        progress(1.0)
    assert capsys.readouterr().err == "walk: 1.0 of 10.0 s simulated in 21.0 s, about 9 s left\n"


def test_progress_of_nothing_is_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with shown_progress("push", 0, "searches") as progress:
        progress(0)
    assert capsys.readouterr().err == ""


def test_progress_prints_each_report_on_request(capsys: pytest.CaptureFixture[str]) -> None:
    with shown_progress("worth", 100, "cases", every=True) as progress:
        progress(0, "none")
        progress(0, "DCBF")
    assert [line.rpartition(", ")[2] for line in capsys.readouterr().err.splitlines()] == ["none", "DCBF"]


def test_progress_on_a_terminal_is_a_bar(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    with shown_progress("push", 2, "searches") as progress:
        progress(2, "found")
    shown = capsys.readouterr().err
    assert "100%|" in shown
    assert "2 of 2 searches" in shown
    assert "found" in shown


def test_a_table_aligns_numbers_to_the_right_and_has_dashes_for_missing_cells() -> None:
    rows = [("x", 1.23456, None, True), ("long", float("nan"), 10, False)]
    assert table(rows, ("name", "value", "n", "yes?")).splitlines() == [
        "name  value   n  yes?",
        "---------------------",
        "x     1.235   –   yes",
        "long      –  10    no",
    ]
    assert table([("a", "b"), ("longer", "c")]) == "a       b\nlonger  c"


def test_json_has_null_for_nan_and_infinity(tmp_path: Path) -> None:
    write_json(tmp_path / "a.json", {"rows": [(1.0, float("nan")), [float("inf"), "γ"]]})
    assert json.loads((tmp_path / "a.json").read_text()) == {"rows": [[1.0, None], [None, "γ"]]}
