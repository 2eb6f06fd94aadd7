"""`pdhocbf check`: a wrong robot file is named as what it is, and a walk beyond its robot too."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bipeds
import pytest
import yaml

from pdhocbf_drake.cli.main import main
from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.fitting.findings import Finding
from pdhocbf_drake.fitting.walk_checks import walk_findings
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.limits import within_its_limits
from pdhocbf_drake.simulation.scenario_file import load_scenario

SEEDS = (None, 0, 3, 6)
Data = dict[str, Any]
Change = Callable[[Data], None]


def both(data: Data, change: Change) -> None:
    for side in ("left", "right"):
        change(data[side])


def sole_off(data: Data) -> None:
    size = max(1.0, data["left"]["sole"]["half_size"][1] / 0.06)  # 20 mm, of larger soles than the packaged ones more
    data["left"]["sole"]["xyz"][0] += 0.02 * size


def sole_too_large(data: Data) -> None:
    both(
        data, lambda leg: leg["sole"].update(half_size=[1.3 * leg["sole"]["half_size"][0], leg["sole"]["half_size"][1]])
    )


def yaw_and_roll_swapped(data: Data) -> None:
    joints = data["right"]["joints"]
    joints["hip_yaw"], joints["hip_roll"] = joints["hip_roll"], joints["hip_yaw"]


def ankles_swapped(data: Data) -> None:
    joints = data["left"]["joints"]
    joints["ankle_pitch"], joints["ankle_roll"] = joints["ankle_roll"], joints["ankle_pitch"]


def knee_backwards(data: Data) -> None:
    both(data, lambda leg: leg.update(bent_knee={role: -angle for role, angle in leg["bent_knee"].items()}))


def one_hip_sign(data: Data) -> None:
    data["left"]["bent_knee"]["hip_pitch"] *= -1.0


def sides_exchanged(data: Data) -> None:
    data["left"], data["right"] = data["right"], data["left"]


def joints_exchanged(data: Data) -> None:
    data["left"]["joints"], data["right"]["joints"] = data["right"]["joints"], data["left"]["joints"]


def knee_is_ankle(data: Data) -> None:
    joints = data["left"]["joints"]
    joints["knee_pitch"], joints["ankle_pitch"] = joints["ankle_pitch"], joints["knee_pitch"]


def sole_upside_down(data: Data) -> None:
    data["left"]["sole"]["rpy"] = [3.14159, 0.0, 0.0]


def knee_straight(data: Data) -> None:
    data["right"]["bent_knee"] = dict.fromkeys(data["right"]["bent_knee"], 0.0)


WRONG = {
    sole_off: ("left.sole", r"its rectangle reaches \d+ mm beyond the foot; one of half_size .* fits, with its centre"),
    sole_too_large: ("left.sole", r"its rectangle reaches \d+ mm beyond the foot; one of half_size"),
    yaw_and_roll_swapped: ("right.joints.hip_yaw", r"'right_hip_roll' turns about the axis ahead \(roll\)"),
    ankles_swapped: ("left.joints.ankle_pitch", r"'left_ankle_roll' turns about the axis ahead \(roll\)"),
    knee_backwards: ("left.bent_knee.knee_pitch", r"-?0\.8 rad bends the knee backwards; it bends forward with "),
    one_hip_sign: ("left.bent_knee", r"tilted by \d+°.*with hip_pitch of the other sign by [0-9]°"),
    sides_exchanged: ("left, right", r"left and right are exchanged: the left sole is at y = -"),
    joints_exchanged: ("left.sole.link", r"'left_foot' is not moved by joint 'right_hip_yaw'.*exchange left.joints"),
    sole_upside_down: ("left.sole.rpy", "z axis points down; turn its roll"),
    knee_straight: ("right.bent_knee.knee_pitch", "leaves the knee straight.*give the angle of a knee that bends"),
    knee_is_ankle: ("left.joints", r"the knee, 'left_ankle_pitch', must come after the hip's joints"),
}


def checked(path: Path, capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, list[dict[str, str]]]:
    """Exit code and findings of `pdhocbf check`."""
    code = main(["check", str(path), "--json", *words])
    return code, json.loads(capsys.readouterr().out)


def robot_file(folder: Path, seed: int | None, change: Change | None = None) -> Path:
    path = bipeds.write(folder, bipeds.resized(1.0) if seed is None else bipeds.random_shape(seed))
    data = yaml.safe_load(path.read_text())
    if change is not None:
        change(data)
    path.write_text(yaml.safe_dump(data))
    return path


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("change", WRONG, ids=lambda change: change.__name__)
def test_a_wrong_entry_is_named_as_what_it_is(
    change: Change, seed: int | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, findings = checked(robot_file(tmp_path, seed, change), capsys)
    wrong = [finding for finding in findings if finding["level"] != "ok"]
    key, pattern = WRONG[change]
    assert wrong[0]["key"].startswith(key)
    assert re.search(pattern, f"{wrong[0]['said']}; {wrong[0]['fix']}")
    assert code == int(wrong[0]["level"] == "fault")


@pytest.mark.parametrize("seed", [None, 0, 2, 7])
def test_a_torso_that_faces_backwards_is_no_exchange_of_sides(
    seed: int | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def backwards(data: Data) -> None:
        data["torso_rpy"] = [0.0, 0.0, 3.14159 if data["torso_rpy"][2] == 0.0 else 0.0]

    code, findings = checked(robot_file(tmp_path, seed, backwards), capsys)
    assert code == 1
    assert findings[-2]["key"] == "torso_rpy"
    assert findings[-2]["said"].startswith("the torso faces backwards: the knees bend towards its −x")


def test_a_torso_that_faces_sideways_or_lies_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for turn, says in (([0.0, 0.0, 1.5708], "points sideways"), ([0.0, 1.5708, 0.0], "don't hang down")):
        path = robot_file(tmp_path, None, lambda data, turn=turn: data.update(torso_rpy=turn))  # type: ignore[misc]
        _, findings = checked(path, capsys)
        assert says in next(finding["said"] for finding in findings if finding["key"] == "torso_rpy")


def test_a_fatal_entry_is_refused_by_every_command_in_the_same_words(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"left and right are exchanged: .*; exchange the two entries"):
        load_scenario("walking", f"robot: {robot_file(tmp_path, None, sides_exchanged)}")


@pytest.mark.parametrize("seed", SEEDS)
def test_a_right_file_has_no_fault(seed: int | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, findings = checked(robot_file(tmp_path, seed), capsys)
    assert code == 0
    assert {finding["level"] for finding in findings} == {"ok"}


def levels(text: str) -> dict[str, tuple[str, str, str]]:
    """By its name, the worst finding of a packaged walk with overrides: level, key, and what it says."""
    scenario = load_scenario("walking", text)
    recovery = scenario.mpc.recovery
    found = walk_findings(Biped.load("biped"), scenario.gait, recovery and recovery.zmp_box)
    order = ["ok", "note", "fault"]
    return {f.check: (f.level, f.key, f"{f.said}; {f.fix}") for f in sorted(found, key=lambda f: order.index(f.level))}


@pytest.mark.parametrize(
    ("text", "check", "level", "key", "says"),
    [
        ("gait: {stride: 0.2}", "swing leg", "note", "gait.stride", "0.66 of the half sole; .* gait.stride 0.182"),
        ("gait: {stride: 0.3}", "swing leg", "fault", "gait.stride", "0.9. of the half sole; up to 0.6 walks well"),
        ("gait: {stride: 0.7}", "reach", "fault", "gait.stride", "allowed is up to 0.4"),
        ("gait: {com_height: 0.7}", "reach", "fault", "gait.com_height", "allowed is 0.33 to 0.62 m"),
        ("{gait: {stance_width: 0.11}, mpc: {stance_width_min: 0.1}}", "feet", "fault", "gait.stance_width",
         r"overlap .* allowed is 0\.12 m or more"),
        ("gait: {zmp_box: [0.3, 0.1]}", "ZMP box", "fault", "gait.zmp_box", "allowed is up to 0.2 x 0.12 m"),
        ("mpc: {recovery: {zmp_box: [0.3, 0.1]}}", "ZMP box", "fault", "mpc.recovery.zmp_box", "larger than the sole"),
        ("{gait: {ticks_per_step: 70}, mpc: {horizon: 140}}", "step time", "note", "gait.ticks_per_step", "or fewer"),
        ("{gait: {stride: 0.3, ticks_per_step: 16}, mpc: {horizon: 32}}", "joint speed", "fault", "gait", "rad/s"),
    ],
)  # fmt: skip
def test_a_walk_beyond_its_robot_is_named_with_key_and_fix(
    text: str, check: str, level: str, key: str, says: str
) -> None:
    found = levels(text)[check]
    assert found[0] == level
    assert found[1].startswith(key)
    assert re.search(says, found[2])


def test_weak_motors_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Knees that have too little wherever on the soles the ZMP box lies."""

    def weak(data: Data) -> None:
        data["effort_limits"] = [60.0, 100.0, 120.0, 32.0, 80.0, 60.0]

    code, findings = checked(robot_file(tmp_path, None, weak), capsys)
    (torque,) = (finding for finding in findings if finding["check"] == "walking torque")
    assert (code, torque["level"]) == (1, "fault")
    assert re.match(r"(left|right)_knee_pitch needs \d+\.?\d* N m in a step, 1\.\d\d of its limit", torque["said"])


def test_feet_that_overlap_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Whatever the least widths that follow from them would be."""
    path = robot_file(tmp_path, None, lambda data: data.update(stance_width=0.05))
    code, findings = checked(path, capsys)
    (feet,) = (finding for finding in findings if finding["level"] == "fault")
    assert (code, feet["check"]) == (1, "feet")
    with pytest.raises(ModelError, match=r"the soles of robot 'generated' overlap with its feet 0\.05 m apart"):
        within_its_limits(load_scenario("walking", f"robot: {path}"))


def test_torques_that_the_plan_keeps_are_no_fault(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With the ZMP in the middle of the soles the ankles would need more than they have; the plan moves it."""

    def weak(data: Data) -> None:
        data["effort_limits"] = [60.0, 100.0, 120.0, 150.0, 16.6, 60.0]

    path = robot_file(tmp_path, None, weak)
    scenario = load_scenario("walking", f"robot: {path}")
    (seen,) = (f for f in walk_findings(Biped.load(str(path)), scenario.gait, None) if f.check == "walking torque")
    assert seen.level == "fault"
    code, findings = checked(path, capsys)
    (torque,) = (finding for finding in findings if finding["check"] == "walking torque")
    assert (code, torque["level"]) == (0, "note")
    assert re.match(r"(left|right)_ankle_pitch needs 1\d\.?\d* N m in a step, 0\.[89]\d? of its limit", torque["said"])


def test_a_template_has_no_robot_to_check(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "vhip"]) == 1
    assert "only a robot's walk can be checked" in capsys.readouterr().err


def test_findings_are_printed_with_their_keys(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "biped", "--text", "gait: {stride: 0.2}"]) == 0
    out, err = capsys.readouterr()
    assert "note  swing leg" in out
    assert out.count("(gait.stride, gait.ticks_per_step); up to 0.6 walks well: gait.ticks_per_step ") == 1
    assert err == ""
    assert len(set(out.splitlines())) == len(out.splitlines())


def test_run_says_what_was_made_to_fit_and_what_it_doubts(
    tmp_path: Path, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = robot_file(tmp_path / "robot", 5)
    text = f"{{robot: {robot}, duration: 0.5, gait: {{stride: 0.27}}}}"
    assert main(["run", "walking", "--text", text, "--out", "run", "--no-replay", "--verbose"]) == 0
    err = capsys.readouterr().err
    assert f"values fit {robot} (legs 0.765 m" in err
    assert re.search(r"^pdhocbf:   gait: .*swing_height 0.06379 \(0.05\)", err, re.MULTILINE)
    assert re.search(r"note: swing leg: .*0\.8\d of the half sole .*gait\.ticks_per_step \d+, or gait\.stride", err)
    written = yaml.safe_load((elsewhere / "run" / "scenario.yaml").read_text())
    assert written["gait"]["stride"] == 0.27
    assert load_scenario(str(elsewhere / "run" / "scenario.yaml")).to_dict() == written


@pytest.mark.parametrize(("stride", "ticks"), [(0.15, 90), (0.33, 90), (0.33, 45)])
def test_the_cures_of_step_time_and_swing_leg_agree(stride: float, ticks: int) -> None:
    """Whichever is followed, both are well then, or the swing leg asks for no more ticks than the time allows."""
    biped, gait = Biped.load("biped"), load_scenario("walking").gait

    def found(stride: float, ticks: int) -> dict[str, Finding]:
        walk = gait.model_copy(update={"stride": stride, "ticks_per_step": ticks})
        return {each.check: each for each in walk_findings(biped, walk, None)}

    first = found(stride, ticks)
    noted = [first[check] for check in ("step time", "swing leg") if first[check].level != "ok"]
    assert noted
    for note in noted:
        numbers = dict(re.findall(r"gait\.(ticks_per_step|stride) ([\d.]+)", note.fix.partition(", or ")[0]))
        cured = found(float(numbers.get("stride", stride)), int(numbers.get("ticks_per_step", ticks)))
        assert cured[note.check].level == "ok"
        assert "ticks_per_step" not in numbers or {cured["step time"].level, cured["swing leg"].level} == {"ok"}
