"""`pdhocbf limits`: what is planned, robots with other limits, and a slice on the robot."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from pdhocbf_drake.cli.main import main
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.checks import check_scenario
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.limits.command import STUDY
from pdhocbf_drake.studies.limits.rows import BARRIERS
from pdhocbf_drake.studies.limits.table import TABLE, in_order
from pdhocbf_drake.studies.limits.weak import write_weak
from pdhocbf_drake.studies.shared.checks import most

COARSE = "plant: {time_step: 0.005}"


def test_a_robot_has_the_limit_on_both_legs_and_its_own_elsewhere(tmp_path: Path) -> None:
    scenario = write_weak(load_scenario("walking"), ("knee_pitch", 34.0), ("hip_roll", 2.0), tmp_path / "weak.yaml")
    weak, own = Biped.load(scenario.robot), Biped.load("biped")
    for found, theirs, joint, value in (
        (weak.effort_limits, own.effort_limits, 3, 34.0), (weak.velocity_limits, own.velocity_limits, 1, 2.0)
    ):  # fmt: skip
        expected = theirs.reshape(2, 6).copy()
        expected[:, joint] = value
        np.testing.assert_array_equal(found.reshape(2, 6), expected)


@pytest.mark.parametrize(("key", "value"), [("velocity_limits", 0.0), ("effort_limits", -1.0)])
def test_limits_of_zero_or_less_are_refused(tmp_path: Path, key: str, value: float) -> None:
    file = tmp_path / "weak.yaml"
    write_weak(load_scenario("walking"), ("knee_pitch", 34.0), ("hip_roll", 2.0), file)
    file.write_text(file.read_text(encoding="utf-8") + f"{key}: {value}\n", encoding="utf-8")
    with pytest.raises(InputError, match=key):
        Biped.load(str(file))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{left: [60, 100, 120, 150, 80, 60]}", "and right is missing"),
        ("{knee: 30}", "and 'knee' is no side"),
        ("{left: [60, 100], right: 3}", r"and left is \[60, 100\]"),
        ("{left: 60, right: [60, 100, 120, 0, 80, 60]}", "above 0 and up to 1e\\+06 N m, and right knee_pitch has 0"),
        ("[60, 100, 120, 150, -80, 60]", "and ankle_pitch has -80"),
        (".nan", "given: nan"),
        ("strong", "given: 'strong'"),
    ],
)
def test_limits_of_joints_are_refused_with_the_joint_or_the_side(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "weak.yaml"
    write_weak(load_scenario("walking"), ("knee_pitch", 34.0), None, file)
    data = yaml.safe_load(file.read_text(encoding="utf-8")) | {"effort_limits": yaml.safe_load(text)}
    file.write_text(yaml.safe_dump(data), encoding="utf-8")
    with pytest.raises(InputError, match=message) as error:
        Biped.load(str(file))
    assert "\n" not in str(error.value)


_FAR = {"zmp_behind": 1.0, "zmp_ahead": 1.0, "zmp_inward": 1.0, "zmp_outward": 1.0, "step_reach": (0.4, 0.4)}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"zmp_ahead": -1.0}, "zmp_behind and zmp_ahead must be more than 0 m together"),
        (
            {"zmp_middle": (5.0, 0.0)},
            r"zmp_middle in x: the ZMP box of 0.1 m must reach .* \(given: 5.0\)",
        ),
        (
            {"zmp_held": ((-0.1, 0.1),) * 39},
            r"zmp_held: must have an entry for each of the 40 ticks of a step, or none \(given: 39\)",
        ),
        ({"zmp_held": ((0.1, -0.1),) * 40}, r"zmp_held must be \[from, to\] with from <= to \(given: \[0.1, -0.1\]\)"),
        ({"swing_acceleration": 0.0}, "mpc.limits.*swing_acceleration"),
        ({"step_reach": (0.1, 0.4)}, r"gait.stride: must be within mpc.limits.step_reach, 0.1 m \(given: 0.15\)"),
        ({"step_reach": (0.4, 0.1)}, r"gait.stance_width: must be within mpc.limits.step_reach, 0.1 m"),
    ],
)
def test_limits_of_a_plan_that_leave_nothing_are_refused(changes: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        check_scenario(Scenario.from_dict({"gait": {"stride": 0.15}, "mpc": {"limits": _FAR | changes}}, "walk"))


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"friction_belief": 0.0}, "friction_belief"),
        ({"whole_body": {"kind": "qqp"}}, "whole_body.kind"),
        ({"whole_body": {"height": 0.0}}, "whole_body.height: must be from 1e-06"),
        ({"whole_body": {"joint_gamma": (0.7, 0.7)}}, r"at most 1 together \(given: 1.4\)"),
        ({"whole_body": {"joint_gamma": (0.0, 0.3)}}, r"outside \(0, 1\]"),
        ({"whole_body": {"torque_rate": -1.0}}, "whole_body.torque_rate"),
    ],
)
def test_what_can_not_be_kept_is_refused_with_its_key(data: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Scenario.from_dict(data, "walk")


def test_a_walk_is_planned_with_the_program_and_without(tmp_path: Path) -> None:
    work = STUDY.plan(load_scenario("walking"))
    assert list(dict.fromkeys(piece.row for piece in work)) == list(TABLE.kinds)
    assert {piece.row for piece in work if getattr(piece, "kind", "auto") == "closed_form"} < set(TABLE.kinds)
    rows = ["joint barriers", "knee_pitch torque 80 %, closed form", "knee_pitch torque 80 %"]
    assert [check.row for check in in_order(most(row, "falls", 0.0, 0.0) for row in rows)] == rows[::-1]


def test_a_slice_of_the_table_holds_and_is_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "table"
    rows = f"hip_pitch torque 80 %;{BARRIERS}"
    words = ["limits", "walking_nobarrier", "--quick", "--rows", rows, "--text", COARSE]
    assert main([*words, "--workers", "1", "--out", str(out)]) == 0
    found = json.loads((out / "limits.json").read_text(encoding="utf-8"))
    assert [check for check in found["checks"] if not check["holds"]] == []
    assert {check["row"] for check in found["checks"]} == {"hip_pitch torque 80 %", BARRIERS}
    active = next(check["value"] for check in found["checks"] if check["what"] == "active ticks")
    assert active > 20
    assert (out / "limits.txt").read_text(encoding="utf-8").strip() in capsys.readouterr().out
