"""Pushes on the robot, the verb that tries them, and the limits on its legs."""

from __future__ import annotations

import errno
import json
import os
from pathlib import Path

import numpy as np
import pytest
from logs import differences

from pdhocbf_drake.analysis.heading import along
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.robot import Biped, Posture, WholeBodyIk, sole_pose, swing_lever, upright_posture
from pdhocbf_drake.robot.damped import row_weights
from pdhocbf_drake.robot.posture import COM
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.studies.shared import push_search as search
from pdhocbf_drake.studies.shared.endings import GAVE_UP, SURVIVED
from pdhocbf_drake.studies.shared.push_search import Impulse
from pdhocbf_drake.studies.shared.pushing import PushedWalk

SHORT = "gait: {stride: 0.1}"


@pytest.fixture(scope="module")
def walk() -> PushedWalk:
    return PushedWalk(load_scenario("walking", SHORT), [20], with_action=True)


@pytest.fixture(scope="module")
def biped() -> Biped:
    return Biped.load("biped")


def test_a_trial_is_the_run_that_it_is_cut_from(walk: PushedWalk) -> None:
    trial = walk.trial(20, np.array([60.0, 0.0, 0.0]), 0.1, 1.0)
    pushed = f"{SHORT[:-1]}, start_steps: 2}}\npushes: [{{step: 6, phase: 20, force: [60, 0, 0]}}]\nduration: 3.8"
    run = simulate(load_scenario("walking", pushed))
    at = round(trial.log.time[0] / 0.01)
    count = min(len(trial.log), len(run) - at)
    for name in ("robot_state", "com_reference", "push"):
        np.testing.assert_array_equal(trial.log[name][:count], run[name][at : at + count])


def test_small_pushes_are_survived_by_stepping_and_large_ones_have_an_ending(walk: PushedWalk) -> None:
    survived = walk.trial(20, np.array([100.0, 0.0, 0.0]))
    assert survived.ending == SURVIVED
    reasons = survived.log.element("solver_status", "reason")
    assert np.any(reasons == Reason.RECOVERING)
    assert np.all(survived.log.element("solver_status", "fallbacks") == 0)
    assert survived.action.max() > 1e-3  # of the barrier, against the same controller without
    assert survived.action[-80:].max() < survived.action.max()
    assert walk.trial(20, np.array([500.0, 0.0, 0.0])).ending != SURVIVED


def test_a_trial_ends_once_the_walk_has_gone_on_for_a_gait(walk: PushedWalk) -> None:
    force = np.array([60.0, 0.0, 0.0])
    whole, short = walk.trial(20, force), walk.trial(20, force, whole=False)
    assert whole.ending == short.ending == SURVIVED
    assert 90 < len(short.log) < len(whole.log)
    for name in ("robot_state", "com_reference", "push"):
        np.testing.assert_array_equal(short.log[name], whole.log[name][: len(short.log)])
    reasons = short.log.element("solver_status", "reason")
    assert np.all(reasons[-80:] <= Reason.CROSS_SOLVED)
    assert np.any(reasons[-82:-80] == Reason.RECOVERING)


def test_a_push_that_no_simulation_follows_is_an_ending_too(walk: PushedWalk) -> None:
    trial = walk.trial(20, np.array([1e9, 0.0, 0.0]), 0.1, 1.0)
    assert trial.ending == GAVE_UP
    assert not trial.survived
    assert np.all(np.isfinite(trial.log["lip_state"]))


def test_the_same_trial_twice_is_the_same(walk: PushedWalk) -> None:
    force = np.array([0.0, -50.0, 0.0])
    first, second = walk.trial(20, force, 0.1, 1.0), walk.trial(20, force, 0.1, 1.0)
    assert differences(first.log, second.log) == []


def test_swing_reference_never_jumps_under_a_push(walk: PushedWalk) -> None:
    log = walk.trial(20, np.array([100.0, 0.0, 0.0]), 0.1, 1.5).log
    feet = log["foot_reference"].reshape(-1, 2, 3, 3)
    tick, support = log.element("gait_phase", "tick"), log.element("gait_phase", "support")
    for side, foot in ((1, 0), (-1, 1)):
        # A foot in the air, at this tick and the one before.
        flying = (support[1:] == -side) & (tick[1:] > 6)
        moved = np.diff(feet[:, foot, 0, :2], axis=0)
        speed = 0.5 * (feet[1:, foot, 1, :2] + feet[:-1, foot, 1, :2])
        assert abs(moved - 0.01 * speed)[flying].max() < 2e-3


def test_scenarios_that_cannot_be_pushed_are_refused_in_one_sentence() -> None:
    with pytest.raises(InputError, match="ticks of the gait, 0 to 79"):
        PushedWalk(load_scenario("walking", ""), [80])
    with pytest.raises(InputError, match="walk_steps"):
        PushedWalk(load_scenario("walking", "gait: {walk_steps: 4}"), [0])
    with pytest.raises(InputError, match="van_der_pol"):
        PushedWalk(load_scenario("van_der_pol", ""), [0])
    with pytest.raises(InputError, match=r"commands: .* one command, from 0 s on \(given: 2 commands\)"):
        PushedWalk(load_scenario("vhip", "commands: [{time: 0, turn: 0.1}, {time: 1, turn: 0.2}]"), [0])
    with pytest.raises(InputError, match=r"commands: .* \(given: one from 1 s on\)"):
        PushedWalk(load_scenario("vhip", "commands: [{time: 1, turn: 0.1}]"), [0])
    with pytest.raises(InputError, match="path: must be empty"):
        PushedWalk(load_scenario("vhip", "path: [[1, 0]]"), [0])


@pytest.mark.parametrize("phase", [10, 70])
def test_a_push_is_along_the_heading_of_a_walk_that_turns(phase: int) -> None:
    def pushed(yaw: float) -> np.ndarray:
        text = f"{{start: {{yaw: {yaw}}}, commands: [{{time: 0, velocity: [0.3, 0], turn: 0.5}}]}}"
        log = PushedWalk(load_scenario("vhip_nobarrier", text), [phase]).trial(phase, np.array([40.0, 10.0, 0.0])).log
        assert np.hypot(*log["push"][1, :2]) == pytest.approx(np.hypot(40.0, 10.0))
        turned = np.arctan2(*log["push"][1, 1::-1]) - log.element("path", "yaw")[1]
        assert np.remainder(turned, 2.0 * np.pi) == pytest.approx(np.arctan2(10.0, 40.0))
        return along(log["lip_state"][:, [1, 4]], log.element("path", "yaw"))

    np.testing.assert_allclose(pushed(0.0), pushed(2.0), atol=1e-9)


def test_the_verb_writes_its_documented_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from pdhocbf_drake.cli.main import main

    def found(work: search.Search) -> Impulse:
        return Impulse(work.barrier, work.direction, work.phase, 12.0 + work.phase / 10)

    monkeypatch.setattr(search, "search", found)
    out = tmp_path / "pushes"
    words = ["push", "walking", "--directions", "forward,-y", "--phases", "0,40", "--workers", "1", "--out", str(out)]
    assert main(words) == 0
    data = json.loads((out / "push.json").read_text())
    assert set(data) == {"impulse", "median"}
    assert set(data["median"]) == {"none", "DCBF", "P-DHOCBF"}
    assert data["median"]["none"] == {"+x": 14.0, "-y": 14.0}
    assert len(data["impulse"]) == 3 * 2 * 2
    assert {path.name for path in out.iterdir()} == {
        "push.json", "push.txt", "push.png", "push_phases.png", "scenario.yaml",
    }  # fmt: skip


def test_a_figure_that_can_not_be_written_costs_the_figure_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from pdhocbf_drake.cli.main import main

    def full(impulses: list[Impulse], path: Path) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))

    monkeypatch.setattr(search, "search", lambda work: Impulse(work.barrier, "+x", work.phase, 12.5))
    monkeypatch.setattr("pdhocbf_drake.studies.push.results.draw_polar", full)
    words = ["push", "walking", "--directions", "+x", "--phases", "0,40", "--workers", "1", "--out"]
    assert main([*words, str(tmp_path / "pushes")]) == 1
    shown = capsys.readouterr()
    assert shown.out.count("12.5") == 9
    assert "No space left" in shown.err
    assert "Traceback" not in shown.err
    assert {path.name for path in (tmp_path / "pushes").iterdir()} == {
        "push.json", "push.txt", "push_phases.png", "scenario.yaml",
    }  # fmt: skip
    (tmp_path / "file").touch()
    monkeypatch.setattr(search, "search", lambda work: pytest.fail("a search began"))
    assert main([*words, str(tmp_path / "file" / "pushes")]) == 1
    assert "cannot be written" in capsys.readouterr().err


@pytest.mark.parametrize("words", [["--phases", "x"], ["--directions", "up"], ["--tolerance", "0"], ["--workers", "0"]])
def test_wrong_arguments_are_refused_in_one_line(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from pdhocbf_drake.cli.main import main

    assert main(["push", "walking", "--out", str(tmp_path / "no"), *words]) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert words[0].strip("-") in error
    assert not (tmp_path / "no").exists()


def test_a_leg_out_of_reach_gives_up_its_swing_foot_first(biped: Biped) -> None:
    ik = WholeBodyIk(biped)
    com = np.array([0.0, -0.04, 0.58])
    target = Posture(com, sole_pose(-0.45, 0.08), sole_pose(0.0, -0.08))
    seed = upright_posture(biped, com, sole_pose(-0.1, 0.08), sole_pose(0.0, -0.08))
    found = ik.solve(target, seed, "left")
    assert not found.ok
    context = biped.plant.CreateDefaultContext()
    biped.plant.SetPositions(context, found.q)
    left, right = (biped.soles[side].frame.CalcPoseInWorld(context).translation() for side in ("left", "right"))
    assert abs(right - [0.0, -0.08, 0.0]).max() < 5e-3
    assert abs(left[1] - 0.08) < 5e-3
    assert left[0] > -0.45 + 0.02
    forward = np.zeros(18)
    forward[COM] = [1.0, 0.0, 0.0]
    _, vdot = ik.derivatives(found.q, forward, forward, row_weights("left"))
    assert abs(vdot).max() < 300.0


def test_a_swing_foot_drags_the_zmp_its_own_way(biped: Biped) -> None:
    q = upright_posture(biped, np.array([0.0, 0.0, 0.58]), sole_pose(0.0, 0.08), sole_pose(0.0, -0.08))
    lever = swing_lever(biped, q)
    # Heavy legs below the CoM: some millimetres for each m/s².
    assert np.all((lever > 1e-3) & (lever < 1e-2))


def test_ctrl_c_keeps_the_impulses_that_are_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from pdhocbf_drake.cli.main import main

    def found(work: search.Search) -> Impulse:
        if (work.barrier, work.phase) == ("DCBF", 40):
            raise KeyboardInterrupt
        return Impulse(work.barrier, "+x", work.phase, 12.5)

    monkeypatch.setattr(search, "search", found)
    words = ["push", "walking", "--directions", "+x", "--phases", "0,40", "--workers", "1", "--out", str(tmp_path)]
    assert main(words) == 1
    shown = capsys.readouterr()
    assert f"pdhocbf: interrupted; 4 of 6 impulses are in {tmp_path}\n" in shown.err
    assert shown.out.count("12.5") == 7  # four, and a median for each barrier
    kept = json.loads((tmp_path / "push.json").read_text())["impulse"]
    assert [(row["barrier"], row["phase"]) for row in kept] == [
        ("none", 0), ("none", 40), ("DCBF", 0), ("P-DHOCBF", 0),
    ]  # fmt: skip
