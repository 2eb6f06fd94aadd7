"""A run folder is whole or not there."""

from __future__ import annotations

import json
import os

import pytest
import synthetic

from pdhocbf_drake.errors import RunFolderError
from pdhocbf_drake.simulation.provenance import Provenance
from pdhocbf_drake.simulation.run_folder import new_run_folder, read_run, replaced_file, write_run


def test_a_written_run_is_read_back(tmp_path):
    run = synthetic.run()
    with new_run_folder(tmp_path / "run") as folder:
        write_run(folder, run)
    again = read_run(tmp_path / "run")
    assert again.scenario == run.scenario and again.provenance == run.provenance
    assert again.log.differences(run.log) == []


@pytest.mark.parametrize("stop", [KeyboardInterrupt, RuntimeError])
def test_a_run_that_breaks_leaves_nothing(tmp_path, stop):
    with pytest.raises(stop), new_run_folder(tmp_path / "deep" / "run") as folder:
        write_run(folder, synthetic.run())
        raise stop
    assert list((tmp_path / "deep").iterdir()) == []


def test_a_run_that_breaks_leaves_the_older_run(tmp_path):
    with new_run_folder(tmp_path / "run") as folder:
        write_run(folder, synthetic.run(duration=1.0))
    with pytest.raises(RuntimeError), new_run_folder(tmp_path / "run") as folder:
        write_run(folder, synthetic.run(duration=2.0))
        raise RuntimeError
    assert read_run(tmp_path / "run").scenario.duration == 1.0
    assert [entry.name for entry in tmp_path.iterdir()] == ["run"]


def test_nothing_is_in_place_before_the_run_is_complete(tmp_path):
    with new_run_folder(tmp_path / "run"):
        assert not (tmp_path / "run").exists()
    assert (tmp_path / "run").is_dir()


def test_an_older_run_is_replaced(tmp_path):
    for duration in (1.0, 2.0):
        with new_run_folder(tmp_path / "run") as folder:
            write_run(folder, synthetic.run(duration=duration))
    assert read_run(tmp_path / "run").scenario.duration == 2.0
    assert [entry.name for entry in tmp_path.iterdir()] == ["run"]


def test_a_folder_that_is_no_run_is_never_replaced(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(RunFolderError, match=r"not a run folder, since it holds thesis\.tex"), new_run_folder(tmp_path):
        pass
    assert (tmp_path / "thesis.tex").read_text() == "years of work"
    (tmp_path / "file").write_text("")
    with pytest.raises(RunFolderError, match="it is a file"), new_run_folder(tmp_path / "file"):
        pass


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_place_that_cannot_be_written_is_told_before_the_run(tmp_path):
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(RunFolderError, match="Permission denied"), new_run_folder(tmp_path / "run"):
            pytest.fail("the run must not start")
    finally:
        tmp_path.chmod(0o700)


def test_a_place_below_a_file_is_told_before_the_run(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RunFolderError, match="no run can be written to"), new_run_folder(tmp_path / "file" / "run"):
        pytest.fail("the run must not start")


def test_reading_says_what_is_missing(tmp_path):
    with pytest.raises(RunFolderError, match="there is no such folder"):
        read_run(tmp_path / "nowhere")
    with pytest.raises(RunFolderError, match=r"it has no scenario\.yaml, provenance\.json, log\.npz"):
        read_run(tmp_path)
    with new_run_folder(tmp_path / "run") as folder:
        write_run(folder, synthetic.run())
    (tmp_path / "run" / "scenario.yaml").write_text("gaitt: {}")
    with pytest.raises(RunFolderError, match=r"not a run folder of this version: .*gaitt: unknown key"):
        read_run(tmp_path / "run")


def test_a_file_is_replaced_whole_or_not_at_all(tmp_path):
    path = tmp_path / "report.html"
    path.write_text("old")
    with pytest.raises(RuntimeError), replaced_file(path) as staging:
        staging.write_text("ha")
        raise RuntimeError
    assert path.read_text() == "old" and [entry.name for entry in tmp_path.iterdir()] == ["report.html"]


def test_provenance_names_versions_seed_and_machine():
    from datetime import datetime, timezone

    scenario = synthetic.scenario()
    told = Provenance.of_run(scenario, datetime(2026, 1, 2, tzinfo=timezone.utc), 1.5)
    data = json.loads(told.model_dump_json())
    assert data["packages"]["drake"] == "1.51.1" and data["seed"] == scenario.seed
    assert data["started"] == "2026-01-02T00:00:00+00:00" and data["wall_seconds"] == 1.5
    assert data["machine"] and data["cores"] >= 1
    assert data["commit"] is None or len(data["commit"]) == 40
