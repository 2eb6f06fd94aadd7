"""The study of commanded walks: its table, its motions of logs, and a slice of it on the robot."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from pdhocbf_drake.cli import main
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.run_folder import read_run
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.studies.directions import pushes, stops, waypoints
from pdhocbf_drake.studies.directions.motions import WORLD, difference, mirrored, moved
from pdhocbf_drake.studies.directions.plan import QUICK_ROWS, ROWS, plan
from pdhocbf_drake.studies.shared.check_table import table
from pdhocbf_drake.studies.shared.checks import combined, least, most

TURN = [{"time": 0.0, "velocity": [0.25, 0.1], "turn": 0.5}, {"time": 2.0, "velocity": [0.3, 0.0], "turn": -0.2}]


def template(commands: list[dict], start: dict | None = None, **gait: str) -> RunLog:
    data = load_scenario("vhip").to_dict()
    data = {**data, "duration": 3.0, "commands": commands, "start": start or {}, "gait": {**data["gait"], **gait}}
    return simulate(Scenario.from_dict(data, "walk"))


@pytest.fixture(scope="module")
def turning() -> RunLog:
    return template(TURN)


# The table.


@pytest.mark.parametrize(("make", "kept", "missed"), [(most, 1.0, 1.1), (least, 1.0, 0.9)])
def test_a_check_holds_up_to_its_limit_and_not_without_a_value(make, kept: float, missed: float) -> None:
    assert make("row", "what", kept, 1.0).holds
    assert not make("row", "what", missed, 1.0).holds
    assert not make("row", "what", None, 1.0).holds
    assert not make("row", "what", math.nan, 1.0).holds


def test_several_walks_are_judged_by_their_worst_sum_or_mean() -> None:
    sums = [most("a", "falls", value, 0.0)._replace(combine="sum") for value in (0.0, 2.0, 1.0)]
    means = [least("a", "safe", value, 99.0)._replace(combine="mean") for value in (98.0, 100.0)]
    worst = [least("b", "gap", value, 10.0) for value in (12.0, 11.0)] + [
        most("b", "error", v, 5.0) for v in (1.0, 4.0)
    ]
    found = combined([*sums, *means, *worst])
    assert [(c.what, c.value) for c in found] == [("falls", 3.0), ("safe", 99.0), ("gap", 11.0), ("error", 4.0)]
    assert math.isnan(combined([most("b", "error", 1.0, 5.0), most("b", "error", None, 5.0)])[0].value)


def test_what_is_missed_is_shown_and_so_are_notes() -> None:
    text = table([most("row", "one", 2.0, 1.0), most("row", "other", 1.0, 1.0)], ["sequence 3 fell"])
    assert [line.endswith(word) for line, word in zip(text.splitlines()[2:4], ("NO", "yes"), strict=True)] == [True] * 2
    assert text.endswith("sequence 3 fell")


def test_every_row_is_planned_and_only_a_quick_table_leaves_the_pushes_out() -> None:
    scenario = load_scenario("walking")
    assert {piece.row for piece in plan(scenario)} == set(ROWS)
    assert {piece.row for piece in plan(scenario, quick=True)} == set(QUICK_ROWS) == set(ROWS) - {pushes.ROW}
    assert len(plan(scenario, ["random"], walks=7)) == 7


def test_a_table_that_cannot_be_made_is_refused_in_one_sentence() -> None:
    for words, changes, message in (
        ({"rows": ["spiral"]}, "", "rows: some of circle, .* are needed .*'spiral'"),
        ({"rows": []}, "", "rows: .*none"),
        ({"walks": 0}, "", "walks must be 1 or more"),
        ({}, "commands: [{time: 0, turn: 0.1}]", "commands: must be empty here"),
        ({}, "gait: {walk_steps: 3}", "a walk of a robot without an end is needed"),
    ):
        with pytest.raises(InputError, match=message):
            plan(load_scenario("walking", changes), **words)
    with pytest.raises(InputError, match="a walk of a robot"):
        plan(load_scenario("vhip"))


def test_stops_come_at_ticks_spread_over_the_whole_gait() -> None:
    scenario, ticks = load_scenario("walking").model_dump_json(), []
    for piece in plan(load_scenario("walking"), [stops.ROW]):
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
    assert main(["directions", "walking", "--quick", "--rows", rows, "--workers", "1", "--out", str(out)]) == 0
    found = json.loads((out / "directions.json").read_text(encoding="utf-8"))
    missed = [check for check in found["checks"] if not check["holds"]]
    assert missed == []
    assert found["holds"] is True
    assert {check["row"] for check in found["checks"]} == set(rows.split(","))
    assert (out / "directions.txt").read_text(encoding="utf-8").strip() in capsys.readouterr().out


def test_single_walks_are_kept_as_run_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from pdhocbf_drake.studies.directions import steady
    from pdhocbf_drake.studies.directions.study import directions

    monkeypatch.setitem(steady.ROWS, "in place", steady.ROWS["in place"]._replace(duration=3.0))
    checks, notes = directions(load_scenario("walking"), rows=["in place"], out=tmp_path / "table")
    run = read_run(tmp_path / "table" / "in_place")
    assert run.log.time[-1] == pytest.approx(3.0)
    assert (tmp_path / "table" / "in_place" / "figures" / "footsteps.png").exists()
    assert all(check.row == "in place" for check in checks)
    assert notes == []
