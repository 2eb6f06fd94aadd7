"""Driven walks: what was pressed simulates again to the same bits, in a script and by hand in a browser."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pydrake.geometry import Meshcat

from pdhocbf_drake import Run, Scenario, load_scenario, read_run, simulate
from pdhocbf_drake.analysis.pushes import push_rows
from pdhocbf_drake.cli.main import main
from pdhocbf_drake.config import parse_config
from pdhocbf_drake.driving.barrier_sliders import BarrierSliders, said_of
from pdhocbf_drake.driving.controls import SIDES, Asked, Kept, Pushed
from pdhocbf_drake.driving.panel import AT_FIRST, strongest_push
from pdhocbf_drake.driving.script import Press, Script
from pdhocbf_drake.driving.session import Session, drivable
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.run_log import FELL, FINISHED, RunLog
from pdhocbf_drake.walking.commands import Command

PRESSES = [
    {"time": 0.25, "forward": 0.3},
    {"time": 1.63, "turn": 0.4},
    {"time": 1.9, "barrier": "forward_speed", "kind": "constant", "margin": 0.02, "gamma": 0.3},
    {"time": 2.2, "push": "from the left", "impulse": 2.0},
    {"time": 2.25, "push": "from behind", "impulse": 1.0},
    {"time": 2.4, "turn": 0.2},  # where a step begins
    {"time": 2.5, "barrier": "forward_speed", "kind": "none"},
    {"time": 2.55, "barrier": "unheard-of", "kind": "none"},  # is left out
    {"time": 2.79, "turn": 0.3},
    {"time": 3.1, "turn": 0.0, "forward": 0.0},
]


def script(presses: list[dict]) -> Script:
    return Script(tuple(parse_config(Press, press, "presses") for press in presses))


def equal(one: RunLog, other: RunLog) -> None:
    assert len(one) == len(other)
    for name, table in one.signals.items():
        if name == "solver_status":  # has the wall time of each tick
            table, again = table[:, [0, *range(2, 6)]], other[name][:, [0, *range(2, 6)]]
        else:
            again = other[name]
        np.testing.assert_array_equal(table, again, err_msg=name)


@pytest.mark.parametrize(("name", "seconds"), [("vhip", 4.5), ("walking", 2.6)])
def test_a_drive_simulates_again_to_the_same_bits(name: str, seconds: float) -> None:
    driven = Session(load_scenario(name), script(PRESSES).at, pace=False).run(seconds)
    assert driven.log.ending == FINISHED
    assert driven.scenario.duration == pytest.approx(seconds)
    assert "was driven" in driven.scenario.description  # not what the scenario does by itself
    assert [push.time for push in driven.scenario.pushes] == [2.2, 2.25]
    said = dict(push_rows(Run.of(driven.scenario, driven.log)))["pushed"]
    assert [words.partition(" N s ")[0] for words in said.split("; ")] == ["2", "1"]
    assert [command.time for command in driven.scenario.commands][:4] == pytest.approx([0.0, 0.26, 1.64, 2.41])
    changes = [(change.time, change.kind, change.gamma) for change in driven.scenario.barrier_changes]
    assert changes == [(1.91, "constant", (0.3,)), (2.51, "none", None)]
    equal(driven.log, simulate(Scenario.from_dict(driven.scenario.to_dict(), "again")))


def test_what_was_pressed_too_late_in_a_step_is_noted_when_it_was_read() -> None:
    presses = [
        {"time": 0.0, "forward": 0.2},
        {"time": 0.5, "push": "from behind", "impulse": 0.1},
        {"time": 1.18, "turn": 0.4},  # read in the step from 1.2 s on
        {"time": 1.97, "turn": 0.2},  # never read
        {"time": 1.99, "forward": 0.0, "turn": 0.0, "walks": False},
    ]
    driven = Session(load_scenario("vhip"), script(presses).at, pace=False).run(3.0)
    assert [command.time for command in driven.scenario.commands] == pytest.approx([0.0, 0.01, 1.21, 2.0])
    equal(driven.log, simulate(driven.scenario))


def test_the_script_of_the_page_is_one(tmp_path: Path) -> None:
    page = (Path(__file__).parents[1] / "docs" / "drive.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)
    (tmp_path / "presses.yaml").write_text(text, encoding="utf-8")
    pressed = Script.read(tmp_path / "presses.yaml")
    assert pressed.at(2.5) == Asked(Command(0.3, 0.0, 0.4))
    barrier = Kept("forward_speed", "constant", 0.02, 0.3)
    assert pressed.at(5.0) == Asked(Command(), (Pushed("from the left", 3.0),), (barrier,))


def test_a_push_comes_from_the_side_that_it_names() -> None:
    for heading in (0.0, 0.7):
        c, s = np.cos(heading), np.sin(heading)
        seen = {side: np.array([[c, s], [-s, c]]) @ Pushed(side, 3.0).force(heading)[:2] for side in SIDES}
        assert seen["from behind"] == pytest.approx([30.0, 0.0], abs=1e-9)
        assert seen["from the front"] == pytest.approx([-30.0, 0.0], abs=1e-9)
        assert seen["from the left"] == pytest.approx([0.0, -30.0], abs=1e-9)
        assert seen["from the right"] == pytest.approx([0.0, 30.0], abs=1e-9)


def test_a_restart_forgets_and_a_pause_waits() -> None:
    asked = iter([Asked(Command(0.3))] * 40 + [Asked(restarts=True)] + [Asked(paused=True)] * 3)
    driven = Session(load_scenario("vhip"), lambda now: next(asked, Asked()), pace=False).run(0.5)
    assert [command.stop for command in driven.scenario.commands] == [True]
    assert len(driven.log) == 51
    assert np.abs(driven.log.element("lip_state", "vx")).max() < 1e-9


@pytest.mark.parametrize("side", SIDES)
def test_the_first_push_of_the_panel_is_survived_whenever_it_comes(side: str) -> None:
    scenario = load_scenario("vhip")
    impulse = AT_FIRST * strongest_push(scenario)
    times = 2.0 + 2.9 * np.arange(8)  # each tenth of a second of a gait of 0.8 s
    pushes = [{"time": float(time), "push": side, "impulse": impulse} for time in times]
    pressed = script([{"time": 0.2, "forward": 0.2}, *pushes])
    driven = Session(scenario, pressed.at, pace=False).run(25.0)
    assert driven.log.ending == FINISHED
    assert len(driven.scenario.pushes) == len(times)


def test_a_fall_is_recorded() -> None:
    hard = script([{"time": 0.2, "push": "from the right", "impulse": 1000.0}])
    driven = Session(load_scenario("vhip"), hard.at, pace=False).run(20.0)
    assert driven.log.ending == FELL
    assert driven.log.time[-1] < 19.0


def test_an_oscillator_is_refused() -> None:
    with pytest.raises(InputError, match="walks can be driven"):
        drivable(load_scenario("van_der_pol"))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("presses: [{time: -1.0}]", "presses.0.time"),
        ("presses: [{time: 1.0, push: above}]", "from behind"),
        ("presses: [{time: 1.0, forward: .nan}]", "presses.0.forward"),
        ("nothing: 1", "presses"),
        ("presses: [{time: 1.0, kind: none}]", "give barrier"),
        ("presses: [{time: 1.0, barrier: forward_speed}]", "kind, margin or gamma"),
    ],
)
def test_a_wrong_script_is_named(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "script.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=said):
        Script.read(path)


def test_a_script_of_another_walk_is_refused_before_the_drive(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "script.yaml"
    path.write_text("presses:\n  - {time: 9.0, barrier: sideways, gamma: 0.3}\n", encoding="utf-8")
    assert main(["drive", "vhip", "--script", str(path), "--headless", "--out", str(tmp_path / "run")]) == 1
    said = r"presses\.0\.barrier: must be a barrier of the walk: forward_speed \(given: sideways\)"
    assert re.search(said, capsys.readouterr().err)


def test_a_drive_that_waits_for_nobody_shows_how_far_it_is_and_has_no_late_ticks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "script.yaml").write_text("presses: [{time: 0.2, forward: 3.0}, {time: 1.5}]", encoding="utf-8")
    words = ["--script", str(tmp_path / "script.yaml"), "--headless", "--seconds", "1", "--no-replay"]
    assert main(["drive", "vhip", *words, "--out", str(tmp_path / "run")]) == 0
    out, err = capsys.readouterr()
    assert "vhip: 1.0 of 1.0 s simulated in " in err
    assert "the drive ends at 1 s, before " in err
    assert "script.yaml.presses.1 at 1.5 s" in err
    assert "late" not in (out + err).replace("simulated", "")
    assert json.loads((tmp_path / "run" / "metrics.json").read_text(encoding="utf-8"))["late_ticks"] is None


def test_sliders_change_a_barrier_and_are_put_back() -> None:
    config = load_scenario("vhip").barriers["forward_speed"]
    meshcat = Meshcat()
    sliders = BarrierSliders(meshcat, "forward_speed", "of forward_speed", config)
    assert sliders.read() is None
    kind, margin, gamma = (
        next(name for name in meshcat.GetSliderNames() if word in name) for word in ("periodic", "margin", "gamma")
    )
    meshcat.SetSliderValue(kind, 0.0)
    assert sliders.read() == Kept("forward_speed", "none")
    meshcat.SetSliderValue(margin, 5.0 * config.bound.margin)
    meshcat.SetSliderValue(gamma, 0.8)  # between two of them
    assert sliders.read() == Kept("forward_speed", None, pytest.approx(5.0 * config.bound.margin, abs=1e-6), 0.9)
    sliders.reset()
    assert sliders.read() is None
    assert meshcat.GetSliderValue(kind) == 2.0


@pytest.mark.parametrize("names", [["forward_speed"], ["forward_speed", "forward_speed_too"]])
def test_sliders_of_barriers_differ_in_the_part_of_their_labels_that_is_shown(names: list[str]) -> None:
    config = load_scenario("vhip").barriers["forward_speed"]
    meshcat = Meshcat()
    for name, said in said_of(names).items():
        BarrierSliders(meshcat, name, said, config)
    shown = {label[:10] for label in meshcat.GetSliderNames()}
    assert len(shown) == 3 * len(names)


def test_it_is_driven_by_hand_in_a_browser(chromium: str, tmp_path: Path) -> None:
    sync_api = pytest.importorskip("playwright.sync_api")
    words = ["drive", "vhip", "--out", str(tmp_path / "run"), "--no-replay"]
    code = "import sys; from pdhocbf_drake.cli import main; sys.exit(main())"
    process = subprocess.Popen([sys.executable, "-c", code, *words], stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    address = re.search(r"http://\S+\d", process.stderr.readline())
    assert address is not None
    assert "localhost" in address[0]
    with sync_api.sync_playwright() as player:
        arguments = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        browser = player.chromium.launch(executable_path=chromium, args=arguments)
        page = browser.new_page(viewport={"width": 1000, "height": 800})
        page.goto(address[0])
        page.get_by_text("Open Controls").click()
        page.get_by_text("push from the left").wait_for()
        page.wait_for_timeout(500)
        for _ in range(4):
            page.keyboard.press("KeyW")
            page.wait_for_timeout(60)
        page.wait_for_timeout(1000)
        page.get_by_text("push from the left").click()
        page.wait_for_timeout(500)
        page.get_by_text("end", exact=True).click()
        assert process.wait(60) == 0
        browser.close()
    run = read_run(tmp_path / "run")
    assert [command.velocity for command in run.scenario.commands][-1] == (0.2, 0.0)
    (push,) = run.scenario.pushes
    assert push.force[1] < 0.0
    equal(run.log, simulate(run.scenario))
