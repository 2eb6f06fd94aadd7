"""The experiments of `pdhocbf worth` in small, on the template and on a made-up robot."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from synthetic import walk_log

from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.shared.cases import DCBF, NONE, PERIODIC
from pdhocbf_drake.studies.shared.endings import SURVIVED
from pdhocbf_drake.studies.shared.pushing import Trial
from pdhocbf_drake.studies.worth import experiments
from pdhocbf_drake.studies.worth.experiments import RobotWorth, TemplateWorth
from pdhocbf_drake.studies.worth.results import Measures, table

LATERAL = "barriers: {forward_speed: null, lateral_speed: {axis: y, bound: {kind: orbit, margin: 0.15}}}"


def measured(text: str = "", kick: float = 0.02, gamma: float = 0.5) -> list[Measures]:
    """A kick, a push, a wrong command and no event, on the template."""
    worth = TemplateWorth(load_scenario("vhip", text), kick, 0.2, 1.07, [15])
    worth.events["no event"] = np.zeros((1, 2))
    return worth.run([gamma])


def by_case(rows: list[Measures], event: str) -> dict[str, Measures]:
    return {row.barrier: row for row in rows if row.event.startswith(event)}


@pytest.fixture(scope="module")
def rows() -> list[Measures]:
    return measured()


def test_in_medians_never_comes_last() -> None:
    row = Measures("template", "DCBF", 0.5, "kick", 0, math.nan, 0.0, 0.02, 0.1, 1.0, 0.03, True)
    line = table([row, row._replace(phase=5), row._replace(phase=10, notices=0.1)]).splitlines()[-1]
    assert line.split()[:5] == ["kick", "DCBF", "0.5", "1/3", "–"]


def test_in_several_processes_the_rows_are_the_same(rows: list[Measures]) -> None:
    reported: list[int] = []
    worth = TemplateWorth(load_scenario("vhip", ""), 0.02, 0.2, 1.07, [15])
    shared = worth.run([0.5], lambda done, case: reported.append(done), workers=2)
    own = [row for row in rows if row.event != "no event"]
    assert list(map(str, shared)) == list(map(str, own))
    assert reported == [1, 2, 3]
    assert not worth.stopped


def test_a_kick_is_noticed_at_once_by_the_periodic_bound_alone(rows: list[Measures]) -> None:
    kicks = by_case(rows, "kick")
    assert kicks[PERIODIC].notices == 0.0
    assert kicks[PERIODIC].acts == 0.0
    assert kicks[DCBF].notices != 0.0
    # An instantaneous gain of velocity is its own largest excess, with any barrier.
    assert {round(row.excess, 3) for row in kicks.values()} == {0.02}
    assert kicks[PERIODIC].recovers <= kicks[NONE].recovers


def test_the_action_in_an_undisturbed_walk_is_no_answer_to_an_event(rows: list[Measures]) -> None:
    assert all(math.isnan(row.acts) for row in by_case(rows, "no event").values())
    # Where it does a lot to it: the ZMP velocity changes by more than 1 m/s.
    slow = by_case(measured(gamma=0.05), "no event")
    assert all(math.isnan(row.acts) for row in slow.values())


class _MadeUpWalk:
    """A robot whose barrier changes the undisturbed input by 5 mm/s, and by 20 mm/s from 70 ms after a kick on."""

    def __init__(self, scenario: Scenario, phases: list[int], with_action: bool) -> None:
        self._braked = bool(scenario.barriers)

    def trial(self, phase: int, force: np.ndarray, duration: float, watch: float) -> Trial:
        log = walk_log(duration=watch)
        action = np.where((np.arange(len(log)) >= 7) & (force[0] == 30.0), 0.02, 0.005) * self._braked
        return Trial(SURVIVED, log, action)


def test_the_action_in_an_undisturbed_robot_walk_is_no_answer_to_an_event(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(experiments, "PushedWalk", _MadeUpWalk)
    found = RobotWorth(load_scenario("walking", ""), 3.0, 20.0, 1.07, [0]).run([0.5])
    acts = {row.event.split()[0]: row.acts for row in found if row.barrier == PERIODIC}
    assert acts["kick"] == pytest.approx(0.07)
    assert math.isnan(acts["push"])
    assert math.isnan(acts["command"])


def test_a_wrong_command_is_held_at_the_bound(rows: list[Measures]) -> None:
    commands = by_case(rows, "command")
    margin = 0.0073
    assert commands[PERIODIC].excess <= margin + 1e-6 < commands[DCBF].excess < commands[NONE].excess
    assert commands[PERIODIC].recovers == 0.0
    assert math.isnan(commands[NONE].recovers)


def test_the_controller_of_the_scenario_is_measured_with_its_recovery() -> None:
    steady, recovering = (by_case(measured(text, 0.2), "kick") for text in ("", "mpc: {recovery: {}}"))
    for case in (NONE, DCBF, PERIODIC):
        assert steady[case] != recovering[case]


def test_a_barrier_on_the_lateral_velocity_does_not_notice_a_forward_kick() -> None:
    for case, row in by_case(measured(LATERAL), "kick").items():
        assert math.isnan(row.notices), case
        assert math.isnan(row.acts), case
        assert row.excess < 1e-6, case


def test_a_barrier_on_the_lateral_velocity_is_measured_against_its_own_orbit() -> None:
    worth = TemplateWorth(load_scenario("vhip", LATERAL), 0.02, 0.2, 1.07, [15])
    worth.events = {"sideways": np.array([[0.0, 0.2]])}
    found = by_case(worth.run([0.5]), "sideways")
    assert all(row.excess > 0.2 - 1e-6 for row in found.values())
    assert found[PERIODIC].notices == 0.0
    assert 0.0 < found[PERIODIC].recovers <= found[NONE].recovers


def test_the_verb_writes_table_figure_and_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rows) -> None:  # type: ignore[no-untyped-def]
    from pdhocbf_drake.cli.main import main

    monkeypatch.setattr(TemplateWorth, "__init__", lambda self, *args: None)
    monkeypatch.setattr(TemplateWorth, "run", lambda self, gammas, report, workers: rows)
    assert main(["worth", "vhip", "--out", str(tmp_path)]) == 0
    written = json.loads((tmp_path / "worth.json").read_text())["rows"]
    assert len(written) == len(rows)
    assert {key for key, value in written[0].items() if value is None} >= {"gamma", "notices"}
    assert (tmp_path / "worth.png").stat().st_size > 10_000
    assert main(["worth", "vhip", "--gamma", "2", "--out", str(tmp_path)]) == 1
