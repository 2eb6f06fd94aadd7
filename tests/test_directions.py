"""The study of commanded walks: its table, its motions of logs, and a slice of it on the robot."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from pdhocbf_drake.cli import main
from pdhocbf_drake.simulation.run_folder import read_run
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.studies.directions import pushes, stops, waypoints
from pdhocbf_drake.studies.directions.command import STUDY
from pdhocbf_drake.studies.directions.motions import WORLD, difference, mirrored, moved
from pdhocbf_drake.studies.directions.table import TABLE

COARSE = "plant: {time_step: 0.005}"
TURN = [{"time": 0.0, "velocity": [0.25, 0.1], "turn": 0.5}, {"time": 2.0, "velocity": [0.3, 0.0], "turn": -0.2}]


def template(commands: list[dict], start: dict | None = None, **gait: str) -> RunLog:
    data = load_scenario("vhip").to_dict()
    data = {**data, "duration": 3.0, "commands": commands, "start": start or {}, "gait": {**data["gait"], **gait}}
    return simulate(Scenario.from_dict(data, "walk"))


@pytest.fixture(scope="module")
def turning() -> RunLog:
    return template(TURN)


# The table.


def test_every_row_is_planned_and_only_a_quick_table_leaves_the_pushes_out() -> None:
    scenario = load_scenario("walking")
    assert {piece.row for piece in STUDY.plan(scenario)} == set(TABLE.kinds)
    assert {piece.row for piece in STUDY.plan(scenario, quick=True)} == set(TABLE.kinds) - {pushes.ROW}
    assert len(STUDY.plan(scenario, ["random"], walks=7)) == 7


def test_stops_come_at_ticks_spread_over_the_whole_gait() -> None:
    scenario, ticks = load_scenario("walking").model_dump_json(), []
    for piece in STUDY.plan(load_scenario("walking"), [stops.ROW]):
        assert piece.scenario == scenario
        commands = stops.commands(40, 0.01, piece.setting["shares"], piece.setting["first"])
        times = [command["time"] for command in commands]
        assert times == sorted(times)
        ticks += [round(command["time"] / 0.01) % 80 for command in commands if "stop" in command]
    assert len(ticks) == 16
    assert max(np.diff(sorted([*ticks, min(ticks) + 80]))) <= 5


@pytest.mark.parametrize("row", waypoints.ROWS)
def test_paths_are_as_large_as_they_are_to_be(row: str) -> None:
    path = np.array([[0.0, 0.0], *waypoints.points(row, 2.0)])
    assert np.ptp(path[:, 0]) == pytest.approx(2.0)
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).sum() > 2.2


# Logs from elsewhere.


@pytest.mark.parametrize(("place", "yaw"), [((30.0, -40.0), 0.0), ((0.0, 0.0), 2.5), ((-3.0, 1.0), -1.0)])
def test_a_moved_log_is_that_of_the_walk_from_there(turning: RunLog, place: tuple[float, float], yaw: float) -> None:
    other = template(TURN, {"position": list(place), "yaw": yaw})
    for signal in WORLD:
        if signal in turning:
            assert difference(moved(turning, signal, place, yaw), other[signal]) < 1e-9, signal
    assert difference(turning["lip_state"], other["lip_state"]) > 0.1


def test_headings_are_compared_up_to_whole_turns() -> None:
    one = np.array([[0.0, 3.1], [1.0, 3.2]])
    other = np.array([[0.0, 3.1], [1.0, 3.2 - 2.0 * np.pi]])
    assert difference(one, other) > 1.0
    assert difference(one, other, (1,)) < 1e-12


def test_a_mirrored_log_is_that_of_the_mirrored_walk(turning: RunLog) -> None:
    commands = [{**c, "velocity": [c["velocity"][0], -c["velocity"][1]], "turn": -c["turn"]} for c in TURN]
    other = template(commands, first_stance="right")
    for signal in WORLD:
        if signal in turning:
            assert difference(mirrored(turning, signal), other[signal]) < 1e-9, signal


# A slice on the robot.


def test_a_slice_of_the_table_holds_and_is_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "table"
    rows = "circle,in place,to the right,backwards,S,stop and start,template,random"
    words = ["directions", "walking", "--quick", "--rows", rows, "--text", COARSE, "--workers", "1", "--out", str(out)]
    assert main(words) == 0
    found = json.loads((out / "directions.json").read_text(encoding="utf-8"))
    missed = [check for check in found["checks"] if not check["holds"]]
    assert missed == []
    assert found["holds"] is True
    assert {check["row"] for check in found["checks"]} == set(rows.split(","))
    assert (out / "directions.txt").read_text(encoding="utf-8").strip() in capsys.readouterr().out


def test_single_walks_are_kept_as_run_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from pdhocbf_drake.studies.directions import steady

    monkeypatch.setitem(steady.ROWS, "in place", steady.ROWS["in place"]._replace(duration=3.0))
    checks, notes = STUDY.measured(load_scenario("walking", COARSE), rows=["in place"], out=tmp_path / "table")
    run = read_run(tmp_path / "table" / "in_place")
    assert run.log.time[-1] == pytest.approx(3.0)
    assert (tmp_path / "table" / "in_place" / "figures" / "footsteps.png").exists()
    assert all(check.row == "in place" for check in checks)
    assert notes == []
