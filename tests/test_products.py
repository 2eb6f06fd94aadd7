"""Run folders, pages and results of studies from Python."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import synthetic

from pdhocbf_drake import InputError, certify, load_scenario, push, read_run, replay, report, write_run
from pdhocbf_drake.errors import RunFolderError

COARSE = "{gait: {ticks_per_step: 10, double_support_ticks: 2, tick: 0.04}, mpc: {horizon: 20, freeze_ticks: 2}}"


def test_a_written_run_is_read_again(tmp_path: Path) -> None:
    made = synthetic.run("vhip", duration=2.5)
    written = write_run(tmp_path / "run", made.log, made.scenario, wall_seconds=2.0)
    read = read_run(str(tmp_path / "run"))
    assert (read.scenario, read.provenance) == (written.scenario, written.provenance)
    np.testing.assert_array_equal(read.log["lip_state"], made.log["lip_state"])
    metrics = json.loads((tmp_path / "run" / "metrics.json").read_text())
    assert metrics["real_time_factor"] == pytest.approx(1.25)


def test_a_folder_of_something_else_is_not_written_over(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    made = synthetic.run("vhip", duration=2.5)
    with pytest.raises(RunFolderError, match=r"it holds thesis\.tex"):
        write_run(tmp_path, made.log, made.scenario)


def test_pages_are_returned_and_written(tmp_path: Path) -> None:
    run = synthetic.run("vhip", duration=2.5)
    motion = replay(run, tmp_path / "new" / "replay.html")
    assert (tmp_path / "new" / "replay.html").read_text(encoding="utf-8") == motion
    page = report([run, run], tmp_path / "report.html", replays=[motion, None])
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == page
    assert page.count("<iframe") == 1
    assert "synthetic (2)" in page
    assert report(run).count("<iframe") == 1


def test_a_report_of_nothing_or_into_a_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="at least one run"):
        report([])
    with pytest.raises(InputError, match="is a folder; the name of a file is needed"):
        report(synthetic.run("vhip", duration=2.5), tmp_path)


def test_a_certificate_is_what_its_file_holds(tmp_path: Path) -> None:
    stages: list[str] = []
    found = certify(
        load_scenario("vhip", COARSE), rows=False, out=tmp_path / "c", progress=lambda done, stage: stages.append(stage)
    )
    assert found == json.loads((tmp_path / "c" / "certify.json").read_text())
    assert found["enforceable"]
    assert found["terminal_set_problem"] is None
    assert stages[0] == "walk and nominal orbit"


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"directions": ["up"]}, r"directions: some of \+x, \+y, -x, -y are needed \(given: 'up'\)"),
        ({"phases": 0}, r"phases: 1 to 80 of them"),
        ({"phases": [80]}, r"phases: ticks of the gait are 0 to 79"),
        ({"barriers": ["CBF"]}, "barriers: a list of none, DCBF, P-DHOCBF"),
        ({"tolerance": 0.0}, "tolerance must be at least 0.01"),
        ({"watch": 1e9}, r"watch must be at least 0.9 and below 1000 s \(given: 1e\+09\)"),
        ({"workers": 0}, r"workers must be 1 to 1024 \(given: 0\)"),
        ({"workers": 10**7}, "workers must be 1 to 1024"),
    ],
)
def test_pushes_that_can_not_be_tried_are_refused(wrong: dict, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        push(load_scenario("walking"), **wrong, out=tmp_path / "push")
    assert not (tmp_path / "push").exists()
