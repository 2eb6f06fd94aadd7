"""`pdhocbf sensing`: what is planned, a slice on the robot, and the limits that count from the exact walk."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from pdhocbf_drake.cli.main import main
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.sensing.command import STUDY
from pdhocbf_drake.studies.sensing.rows import EXACT, ROWS
from pdhocbf_drake.studies.sensing.table import beside_exact
from pdhocbf_drake.studies.sensing.walks import ZMP
from pdhocbf_drake.studies.shared.checks import most

COARSE = "plant: {time_step: 0.005}"


def test_each_row_is_walked_from_each_seed_and_every_walk_can_be_built() -> None:
    walks = STUDY.plan(load_scenario("walking"), seeds=3)
    assert sorted({(walk.row, walk.seed) for walk in walks}) == sorted((row, s) for row in ROWS for s in range(3))
    first, other = (next(w for w in walks if w.row == "wind" and w.seed == seed).sensed() for seed in (0, 1))
    assert first.wind == other.wind == (-10.0, 0.0)
    assert (first.start.yaw, other.start.yaw != 0.0) == (0.0, True)
    assert STUDY.plan(load_scenario("walking"), ["wind"], quick=True)[0].row in (EXACT, "wind")


def test_limits_on_the_zmp_count_from_the_exact_walk() -> None:
    checks = [most("wind", ZMP, value, 3.0, "%")._replace(combine="mean") for value in (5.0, 8.0)]
    found = beside_exact([*checks, most(EXACT, ZMP, 4.0, 100.0, "%")])
    assert [(check.row, check.value, check.limit, check.holds) for check in found] == [
        (EXACT, 4.0, 104.0, True),
        ("wind", 6.5, 7.0, True),
    ]


def test_a_slice_of_the_table_holds_and_is_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "table"
    words = ["sensing", "walking", "--quick", "--rows", "noise, late", "--text", COARSE]
    assert main([*words, "--workers", "1", "--out", str(out)]) == 0
    found = json.loads((out / "sensing.json").read_text(encoding="utf-8"))
    assert [check for check in found["checks"] if not check["holds"]] == []
    assert {check["row"] for check in found["checks"]} == {EXACT, "noise, late"}
    assert (out / "sensing.txt").read_text(encoding="utf-8").strip() in capsys.readouterr().out
