"""The log of a run that goes on: on disk, and readable whatever happens to its process."""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import synthetic
from hypothesis import given
from hypothesis import strategies as st
from logs import differences

from pdhocbf_drake.analysis.replay import replay_html
from pdhocbf_drake.cli import main
from pdhocbf_drake.errors import RunFolderError
from pdhocbf_drake.files.folder import new_folder
from pdhocbf_drake.simulation.log_rows import LogRows, read_rows
from pdhocbf_drake.simulation.run_folder import ENTRIES, ROWS, begin_run, read_run
from pdhocbf_drake.simulation.run_log import INTERRUPTED, RunLog
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate


def columns(log: RunLog) -> dict[str, int]:
    return {name: table.shape[1] for name, table in log.signals.items()}


def part(log: RunLog, start: int, stop: int) -> tuple[dict[str, np.ndarray], np.ndarray]:
    return {name: table[start:stop] for name, table in log.signals.items()}, log.time[start:stop]


def write(folder: Path, log: RunLog, *cuts: int) -> LogRows:
    rows = LogRows(folder, columns(log))
    for start, stop in zip((0, *cuts), (*cuts, len(log)), strict=True):
        assert rows.append(*part(log, start, stop))
    return rows


@given(st.lists(st.integers(0, 100), max_size=5))
def test_rows_written_in_any_pieces_are_the_log(tmp_path_factory, cuts: list[int]) -> None:
    log = synthetic.walk_log(duration=1.0)
    rows = write(tmp_path_factory.mktemp("rows") / "log", log, *sorted(cuts))
    assert differences(RunLog(*rows.read()), log) == []


def test_a_log_on_disk_is_cut_as_one_in_memory(tmp_path) -> None:
    log = synthetic.walk_log(duration=2.0)
    log["lip_state"][150, 2] = np.nan
    mapped = RunLog(*write(tmp_path / "log", log).read())
    for cut in (lambda one: one.after(0.5), RunLog.finite, lambda one: one.after(9.0)):
        assert differences(cut(mapped), cut(log)) == []
    assert len(mapped.finite().after(0.5)) == 100


def test_a_log_stays_while_its_files_are_moved_and_deleted(tmp_path) -> None:
    log = synthetic.walk_log(duration=1.0)
    mapped = RunLog(*write(tmp_path / "log", log).read())
    (tmp_path / "log").rename(tmp_path / "elsewhere")
    assert differences(mapped, log) == []
    shutil.rmtree(tmp_path / "elsewhere")
    mapped.save(tmp_path / "log.npz")
    assert differences(RunLog.load(tmp_path / "log.npz"), log) == []


@pytest.mark.parametrize("name", ["time", "lip_state", "robot_state"])
def test_a_row_that_was_not_written_whole_is_none(tmp_path, name: str) -> None:
    log = synthetic.walk_log(duration=1.0)
    write(tmp_path / "log", log)
    with (tmp_path / "log" / f"{name}.rows").open("rb+") as file:
        file.truncate(os.fstat(file.fileno()).st_size - 3)
    cut = RunLog.of_killed(tmp_path / "log")
    assert cut.ending == INTERRUPTED
    assert differences(cut, RunLog(*part(log, 0, len(log) - 1), INTERRUPTED)) == []


@pytest.mark.parametrize("text", ["", "[]", '{"lip_state": -1}', '{"lip_state": 6, "zmp_box": 4}'])
def test_damaged_rows_are_refused(tmp_path, text: str) -> None:
    write(tmp_path / "log", synthetic.walk_log(duration=1.0))
    (tmp_path / "log" / "columns.json").write_text(text)
    (tmp_path / "log" / "zmp_box.rows").unlink()
    with pytest.raises(RunFolderError, match=r"log has no rows of a run: "):
        read_rows(tmp_path / "log")


def test_rows_that_the_disk_refuses_stay_in_memory(tmp_path) -> None:
    """A limit on the size of files stands for a full disk."""
    scenario = load_scenario("vhip", "duration: 12.0")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    expected = simulate(scenario)
    resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, limits[1]))  # the largest table has 780 kB
    try:
        log = simulate(scenario, rows=tmp_path / "rows")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert differences(log, expected) == []
    assert 0 < (tmp_path / "rows" / "time.rows").stat().st_size < 8 * len(log)


@pytest.mark.parametrize(("name", "duration"), [("vhip", 7.3), ("van_der_pol", 20.0), ("walking", 0.5)])
def test_a_run_is_the_same_whether_its_log_is_on_disk(tmp_path, name: str, duration: float) -> None:
    scenario = load_scenario(name, f"duration: {duration}")
    assert differences(simulate(scenario, rows=tmp_path / "rows"), simulate(scenario)) == []


def test_a_killed_run_is_read_reported_and_not_lost(elsewhere: Path, capsys) -> None:
    code = "from pdhocbf_drake.cli import main; main(['run', 'vhip', '--text', 'duration: 3600', '--out', 'walk'])"
    process = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.DEVNULL)
    try:
        while not [*elsewhere.glob(f".walk.*.part/{ROWS}/time.rows")] or len(read_run("walk").log) < 500:
            assert process.poll() is None
            time.sleep(0.2)
    finally:
        process.kill()
        process.wait()
    killed = read_run("walk")
    rows = len(killed.log)
    assert killed.log.ending == INTERRUPTED
    assert rows % 100 == 0
    unbroken = simulate(load_scenario("vhip", f"duration: {killed.log.time[-1]}"))
    assert differences(killed.log, unbroken) == ["ending"]

    assert main(["run", "vhip", "--text", "duration: 0.1", "--out", "walk", "--no-replay"]) == 0
    says = capsys.readouterr().err
    assert "a run was killed as it was written to walk; what it recorded is now in " in says
    assert len(read_run("walk").log) == 11
    assert len(read_run("walk-killed").log) == rows
    assert main(["report", "walk-killed"]) == 0
    assert (elsewhere / "walk-killed" / "report.html").is_file()


def test_what_killed_runs_left_gets_names_of_its_own(tmp_path) -> None:
    scenario = load_scenario("vhip")
    for duration in (1.0, 2.0):
        with pytest.raises(RunFolderError), new_folder(tmp_path / "walk", ENTRIES) as folder:
            write(begin_run(scenario, folder.path), synthetic.walk_log(False, duration))
            folder.finished = True  # as a killed process leaves it
            raise RunFolderError
        with new_folder(tmp_path / "walk", ENTRIES, keep=ROWS) as folder:
            assert len(folder.saved) == 1
            (folder.path / "scenario.yaml").touch()
    assert [len(read_run(tmp_path / name).log) for name in ("walk-killed", "walk-killed-2")] == [101, 201]


@pytest.mark.parametrize("system", ["biped", "vhip", "van_der_pol"])
def test_a_replay_is_no_larger_than_it_may_be_and_says_so(system: str) -> None:
    run = synthetic.run(system, 40.0)
    whole = replay_html(run)
    largest = 0.5 * (len(whole) + len(replay_html(synthetic.run(system, 0.1))))
    thinned = replay_html(run, largest)
    assert 0.7 * largest < len(thinned) < 1.001 * largest
    assert "frames a second, since the run is long" in thinned
    assert "frames a second" not in whole[-5000:]
