"""The walk that an import writes: one in which `pdhocbf check` finds no fault, or the fault is in its output."""

from __future__ import annotations

import json
import re
from pathlib import Path

import bipeds
import pytest
import yaml

from pdhocbf_drake.cli import main


def imported(folder: Path, shape: bipeds.Shape, role: str, effort: float) -> Path:
    """The scenario of an imported biped, both of whose joints of a role have that torque limit [N m]."""
    limit = rf'(name="(?:left|right)_{role}".*?effort=)"[^"]*"'
    model = folder / "weak.urdf"
    model.write_text(re.sub(limit, rf'\g<1>"{effort}"', bipeds.urdf(shape)))
    assert main(["import", str(model), "--out", str(folder / "bot")]) == 0
    return folder / "bot" / "walking.yaml"


@pytest.mark.parametrize(
    ("shape", "role", "effort", "wrote", "said"),
    [
        (bipeds.Shape(hip=0.24), "ankle_roll", 14.0, set(), "box inward: right_ankle_roll needs 15.2 N m and has 14"),
        (bipeds.Shape(), "hip_pitch", 17.9, {"ticks_per_step"}, ""),
    ],
    ids=["weak ankles under wide hips", "weak hips"],
)
def test_it_writes_a_walk_without_a_fault_of_its_own_check(
    shape: bipeds.Shape, role: str, effort: float, wrote: set[str], said: str, tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    scenario = imported(tmp_path, shape, role, effort)
    output = capsys.readouterr().out
    assert "fault" not in output
    assert set(yaml.safe_load(scenario.read_text()).get("gait", ())) == wrote
    page = scenario.with_name("import.html").read_text()
    assert all(f"{key} " in output and f"in the usual walk left_{role} needs" in page for key in wrote)
    assert main(["check", str(scenario), "--json"]) == 0
    granted = [each["said"] for each in json.loads(capsys.readouterr().out) if each["check"] == "granted"]
    assert said in " ".join(granted)


def test_a_walk_whose_fault_it_can_not_cure_is_said_with_joint_and_key(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario = imported(tmp_path, bipeds.Shape(), "knee_pitch", 5.0)
    faults = [line for line in capsys.readouterr().out.splitlines() if line.startswith("fault of its walk: ")]
    assert any(re.search(r"_knee_pitch needs .* of its limit \(gait\.", line) for line in faults)
    page = scenario.with_name("import.html").read_text()
    assert "What is wrong with its walk" in page
    assert main(["check", str(scenario)]) == 1
    checked = capsys.readouterr().out
    for fault in faults:
        check, _, words = fault.removeprefix("fault of its walk: ").partition(": ")
        assert any(check in line and words in line for line in checked.splitlines() if line.startswith("fault"))
