"""What a barrier buys: measures, and the experiment on the template in small."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from synthetic import walk_log

from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.push.endings import SURVIVED
from pdhocbf_drake.studies.push.measures import Measures, first_time, recovery_time, summarised
from pdhocbf_drake.studies.push.rig import Trial
from pdhocbf_drake.studies.worth import robot as worth_robot
from pdhocbf_drake.studies.worth.command import table
from pdhocbf_drake.studies.worth.robot import RobotWorth
from pdhocbf_drake.studies.worth.template import TemplateWorth


def test_times_are_counted_from_the_event() -> None:
    assert first_time(np.array([False, False, True, True]), 0.01) == pytest.approx(0.02)
    assert math.isnan(first_time(np.zeros(3, dtype=bool), 0.01))
    assert recovery_time(np.array([0.5, 0.0, 0.5, 0.0, 0.0]), 0.1, 0.01) == pytest.approx(0.03)
    assert recovery_time(np.zeros(4), 0.1, 0.01) == 0.0
    assert math.isnan(recovery_time(np.array([0.0, 0.5]), 0.1, 0.01))


def test_medians_put_never_last() -> None:
    row = Measures("template", "DCBF", 0.5, "kick", 0, math.nan, 0.0, 0.02, 0.1, 1.0, 0.03, True)
    rows = [row, row._replace(phase=5), row._replace(phase=10, notices=0.1)]
    (line,) = summarised(rows)
    assert line[:5] == ("kick", "DCBF", "0.5", "1/3", "–")
    assert "kick" in table(rows)
    assert json.loads(json.dumps(row.as_json()))["notices"] is None


@pytest.fixture(scope="module")
def rows() -> list[Measures]:
    worth = TemplateWorth(load_scenario("vhip", ""), 0.02, 0.2, 1.07, [15])
    worth._gains["nothing"] = np.zeros(1)
    return worth.run([0.5])


def test_a_kick_is_seen_at_once_by_the_periodic_bound_alone(rows: list[Measures]) -> None:
    kicks = {row.barrier: row for row in rows if row.event.startswith("kick")}
    assert kicks["P-DHOCBF"].notices == 0.0
    assert kicks["P-DHOCBF"].acts == 0.0
    # An instantaneous gain of velocity is its own largest excess, with any barrier.
    assert {round(row.excess, 3) for row in kicks.values()} == {0.02}
    assert kicks["P-DHOCBF"].recovers <= kicks["none"].recovers


def test_what_a_barrier_does_to_the_undisturbed_walk_is_no_answer_to_an_event(rows: list[Measures]) -> None:
    assert all(math.isnan(row.acts) for row in rows if row.event == "nothing")


class _MadeUpRig:
    """A robot whose barrier changes the undisturbed input by 5 mm/s, and by 20 mm/s from 70 ms after a kick on."""

    def __init__(self, scenario: Scenario, phases: list[int]) -> None:
        self._braked = bool(scenario.barriers)

    def trial(self, phase: int, force: np.ndarray, duration: float, watch: float) -> Trial:
        log = walk_log(duration=watch)
        if self._braked:
            log["zmp_reference"][:, 1] -= np.where((np.arange(len(log)) >= 7) & (force[0] == 30.0), 0.02, 0.005)
        return Trial(SURVIVED, log)


def test_on_the_robot_too_it_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worth_robot, "PushRig", _MadeUpRig)
    found = RobotWorth(load_scenario("walking", ""), 3.0, 20.0, 1.07, [0]).run([0.5])
    acts = {row.event.split()[0]: row.acts for row in found if row.barrier == "P-DHOCBF"}
    assert acts["kick"] == pytest.approx(0.07)
    assert math.isnan(acts["push"]) and math.isnan(acts["command"])


def test_a_wrong_command_is_held_at_the_bound(rows: list[Measures]) -> None:
    commands = {row.barrier: row for row in rows if row.event.startswith("command")}
    margin = 0.0073
    assert commands["P-DHOCBF"].excess <= margin + 1e-6 < commands["DCBF"].excess < commands["none"].excess
    assert commands["P-DHOCBF"].recovers == 0.0
    assert math.isnan(commands["none"].recovers)


def test_the_verb_writes_table_figure_and_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rows) -> None:  # type: ignore[no-untyped-def]
    from pdhocbf_drake.cli.main import main

    monkeypatch.setattr(TemplateWorth, "__init__", lambda self, *args: None)
    monkeypatch.setattr(TemplateWorth, "run", lambda self, gammas, tell: rows)
    assert main(["worth", "vhip", "--out", str(tmp_path)]) == 0
    assert len(json.loads((tmp_path / "worth.json").read_text())["rows"]) == len(rows)
    assert (tmp_path / "worth.png").stat().st_size > 10_000
    assert main(["worth", "vhip", "--gamma", "2", "--out", str(tmp_path)]) == 1
