"""A run folder is complete or not there."""

from __future__ import annotations

import json
import os

import numpy as np
import pytest
import synthetic
from logs import differences

from pdhocbf_drake.errors import RunFolderError
from pdhocbf_drake.simulation.provenance import Provenance
from pdhocbf_drake.simulation.run_folder import new_run_folder, read_run


def test_a_written_run_is_read_back(tmp_path):
    run = synthetic.run()
    with new_run_folder(tmp_path / "run") as folder:
        run.save(folder)
    again = read_run(tmp_path / "run")
    assert again.scenario == run.scenario
    assert again.provenance == run.provenance
    assert differences(again.log, run.log) == []


@pytest.mark.parametrize("stop", [KeyboardInterrupt, RuntimeError])
def test_a_run_that_breaks_leaves_nothing(tmp_path, stop):
    with pytest.raises(stop), new_run_folder(tmp_path / "deep" / "run") as folder:
        synthetic.run().save(folder)
        raise stop
    assert list((tmp_path / "deep").iterdir()) == []


def test_a_run_that_breaks_leaves_the_older_run(tmp_path):
    with new_run_folder(tmp_path / "run") as folder:
        synthetic.run(duration=1.0).save(folder)
    with pytest.raises(RuntimeError), new_run_folder(tmp_path / "run") as folder:
        synthetic.run(duration=2.0).save(folder)
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
            synthetic.run(duration=duration).save(folder)
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
def test_a_place_that_cannot_be_written_is_refused_before_the_run(tmp_path):
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(RunFolderError, match="Permission denied"), new_run_folder(tmp_path / "run"):
            pytest.fail("the run must not start")
    finally:
        tmp_path.chmod(0o700)


def test_a_place_below_a_file_is_refused_before_the_run(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RunFolderError, match="file is a file"), new_run_folder(tmp_path / "file" / "run"):
        pytest.fail("the run must not start")


def test_two_runs_never_write_to_one_place_at_once(tmp_path):
    with new_run_folder(tmp_path / "run") as folder:
        with (
            pytest.raises(RunFolderError, match="another run is being written to it"),
            new_run_folder(tmp_path / "run"),
        ):
            pytest.fail("the second run must not start")
        synthetic.run().save(folder)
    assert len(read_run(tmp_path / "run").log) > 0
    assert [entry.name for entry in tmp_path.iterdir()] == ["run"]


def test_a_name_may_be_as_long_as_the_system_allows(tmp_path):
    with new_run_folder(tmp_path / ("r" * 255)) as folder:
        synthetic.run().save(folder)
    assert [entry.name for entry in tmp_path.iterdir()] == ["r" * 255]
    with (
        pytest.raises(RunFolderError, match="cannot be written: File name too long"),
        new_run_folder(tmp_path / ("r" * 256)),
    ):
        pytest.fail("the run must not start")


def test_a_log_beside_a_scenario_of_another_kind_is_refused(tmp_path):
    for system, says in (("van_der_pol", "it has no oscillator_state"), ("biped", "it has no robot_state")):
        with new_run_folder(tmp_path / system) as folder:
            synthetic.run("vhip")._replace(scenario=synthetic.scenario(system)).save(folder)
        with pytest.raises(RunFolderError, match=says):
            read_run(tmp_path / system)
    with new_run_folder(tmp_path / "bare") as folder:
        bare = synthetic.scenario("vhip").model_copy(update={"barriers": {}})
        synthetic.run("vhip")._replace(scenario=bare).save(folder)
    with pytest.raises(RunFolderError, match="its log's h has 1 columns, and its scenario needs 0"):
        read_run(tmp_path / "bare")
    other = synthetic.run("vhip")
    other.log.signals["barrier_slack"] = np.zeros((len(other.log), 2))
    with new_run_folder(tmp_path / "other") as folder:
        other.save(folder)
    with pytest.raises(RunFolderError, match="its log's barrier_slack has 2 columns, and its scenario needs 1"):
        read_run(tmp_path / "other")


@pytest.mark.parametrize(("limit", "columns"), [(None, 6), ((2.0, 2.0), 8)])
def test_the_constraints_of_the_log_are_those_of_the_scenario(limit, columns, tmp_path):
    scenario = synthetic.scenario("vhip")
    scenario = scenario.model_copy(update={"mpc": scenario.mpc.model_copy(update={"zmp_velocity_max": limit})})
    run = synthetic.run("vhip")._replace(scenario=scenario)
    run.log.signals["unmet"] = np.zeros((len(run.log), columns))
    with new_run_folder(tmp_path / "run") as folder:
        run.save(folder)
    assert read_run(tmp_path / "run").log["unmet"].shape == (len(run.log), columns)
    run.log.signals["unmet"] = np.zeros((len(run.log), columns - 1))
    with new_run_folder(tmp_path / "other") as folder:
        run.save(folder)
    with pytest.raises(RunFolderError, match=f"unmet has {columns - 1} columns, and its scenario needs {columns}"):
        read_run(tmp_path / "other")


def test_reading_names_missing_files_and_unknown_keys(tmp_path):
    with pytest.raises(RunFolderError, match="there is no such folder"):
        read_run(tmp_path / "nowhere")
    (tmp_path / "file").write_text("")
    with pytest.raises(RunFolderError, match="file is not a run folder: it is a file"):
        read_run(tmp_path / "file")
    with pytest.raises(RunFolderError, match=r"it has no scenario\.yaml, provenance\.json, log\.npz"):
        read_run(tmp_path)
    with new_run_folder(tmp_path / "run") as folder:
        synthetic.run().save(folder)
    (tmp_path / "run" / "scenario.yaml").write_text("gaitt: {}")
    with pytest.raises(RunFolderError, match=r"not a run folder of this version: .*gaitt: unknown key"):
        read_run(tmp_path / "run")


def test_provenance_names_versions_seed_and_machine():
    from datetime import datetime, timezone
    from importlib.metadata import version

    scenario = synthetic.scenario()
    provenance = Provenance.of_run(scenario, datetime(2026, 1, 2, tzinfo=timezone.utc), 1.5)
    data = json.loads(provenance.model_dump_json())
    assert data["packages"]["drake"] == version("drake")
    assert data["seed"] == scenario.seed
    assert data["started"] == "2026-01-02T00:00:00+00:00"
    assert data["wall_seconds"] == 1.5
    assert data["machine"]
    assert data["cores"] >= 1
    assert data["commit"] is None or len(data["commit"]) == 40
