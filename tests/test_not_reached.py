"""What a run does not come to: events after its end, and ground beyond its last step."""

from __future__ import annotations

from pathlib import Path

import pytest

from pdhocbf_drake.cli.main import main
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.checks import check_scenario
from pdhocbf_drake.simulation.not_reached import check_pushed, not_reached
from pdhocbf_drake.simulation.scenario_file import load_scenario, scenario_names

FAULT = "{time: 4.0, sensor: imu, kind: lost}"
STAIRS = "{kind: stairs, at: AT, rise: 0.05, tread: 0.25, count: 2}"


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("vhip", "pushes: [{time: 4, force: [1, 0, 0]}, {time: 1, force: [1, 0, 0]}]", "pushes.0 at 4 s"),
        ("vhip", "pushes: [{step: 7, phase: 4, force: [1, 0, 0]}]", "pushes.0 at 3.64 s"),
        ("vhip", "commands: [{time: 0, turn: 0.1}, {time: 3, turn: 0.2}, {time: 5, stop: true}]",
         "commands.1 at 3 s, commands.2 at 5 s"),
        ("vhip", "barrier_changes: [{time: 4, name: forward_speed, kind: none}]", "barrier_changes.0 at 4 s"),
        ("vhip", "gait: {walk_steps: 6}", "the end of gait.walk_steps at 3.2 s"),
        ("vhip", "gait: {walk_steps: 5}", ""),
        ("walking_sensors", f"measurement: {{faults: [{FAULT}]}}", "measurement.faults.0 at 4 s"),
        ("walking", f"measurement: {{faults: [{FAULT}]}}", ""),  # has no sensors
        ("vhip", "commands: [{time: 0, turn: 0.1}, {time: 2.99, turn: 0.2}]", ""),
        ("van_der_pol", "", ""),
    ],
)  # fmt: skip
def test_what_comes_after_the_end_is_said_and_refused_nowhere(name: str, text: str, says: str) -> None:
    scenario = load_scenario(name, f"{{duration: 3.0, {text}}}" if text else "duration: 3.0")
    check_scenario(scenario)
    assert not_reached(scenario) == ([f"the run ends at 3 s, before {says}"] if says else [])


@pytest.mark.parametrize("known", ["true", "false"])
@pytest.mark.parametrize("keys", ["", ", commands: [{time: 0.8, velocity: [0.375, 0]}]", ", start: {position: [5, 0]}"])
def test_ground_beyond_the_last_step_is_said(known: str, keys: str) -> None:
    near, far = ((5.0 if "start" in keys else 0.0) + x for x in (0.6, 2.5))  # 2.2 s at 0.375 m/s are 0.8 m
    pieces = ", ".join(f"{STAIRS.replace('AT', str(at))[:-1]}, known: {known}}}" for at in (near, far))
    scenario = load_scenario("walking", f"{{duration: 3.0, ground: [{pieces}]{keys}}}")
    (sentence,) = not_reached(scenario)
    assert sentence.startswith("the walk comes ")
    assert sentence.endswith("m from its start, not to ground.1, 2.5 m away")
    assert not_reached(scenario.model_copy(update={"duration": 12.0})) == []


def test_waypoints_that_a_run_is_too_short_for_are_said() -> None:
    path = "path: [[1.0, 0.0], [1.0, 1.0]], start: {position: [0.5, 0.0]}, path_speed: 0.2"
    assert not_reached(load_scenario("vhip", f"{{duration: 10.0, {path}}}")) == []
    said = "the walk comes 1 m along its path, not to path.1, 1.5 m along it"
    assert not_reached(load_scenario("vhip", f"{{duration: 5.0, {path}}}")) == [said]


@pytest.mark.parametrize("name", scenario_names())
def test_packaged_scenarios_reach_all_that_they_have(name: str) -> None:
    assert not_reached(load_scenario(name)) == []


def test_a_run_says_it_and_goes_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a_file").touch()
    text = "{duration: 1.0, pushes: [{time: 2.0, force: [1, 0, 0]}]}"
    assert main(["run", "vhip", "--text", text, "--out", str(tmp_path / "a_file")]) == 1
    first, *_, last = capsys.readouterr().err.splitlines()
    assert first == "pdhocbf: the run ends at 1 s, before pushes.0 at 2 s"
    assert "a_file" in last  # which is no folder, so that nothing is simulated here


def test_a_run_of_a_campaign_must_reach_its_pushes() -> None:
    late = load_scenario("vhip", "{duration: 3.0, pushes: [{time: 3.0, force: [1, 0, 0]}]}")
    with pytest.raises(
        InputError, match=r"^pushes\.0: must start before the run ends at 3 s \(given: a start at 3 s\)"
    ):
        check_pushed(late)
    check_pushed(late.model_copy(update={"duration": 3.01}))
