"""The study of gaits: what it varies, what it measures, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from pdhocbf_drake.cli import main
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.studies.gait.plan import default_lines, plan
from pdhocbf_drake.studies.gait.study import gait_study
from pdhocbf_drake.studies.shared.gait_measures import measure, steady_walk
from pdhocbf_drake.studies.shared.gait_variants import KEYS, Work, varied
from pdhocbf_drake.walking import Gait


def test_every_key_of_the_study_is_varied_around_the_scenarios_own_gait() -> None:
    scenario = load_scenario("walking", "gait: {com_height_phase: 20}")
    lines = default_lines(scenario)
    assert set(lines) == set(KEYS)
    for key, values in lines.items():
        assert getattr(scenario.gait, key) in values, key
        for value in values:
            assert getattr(varied(scenario, {key: value}).gait, key) == value


@pytest.mark.parametrize("ticks", [30, 40, 52])
def test_another_step_time_keeps_the_commanded_speed_and_whole_gaits_in_the_horizon(ticks: int) -> None:
    scenario = load_scenario("vhip")
    other = varied(scenario, {"ticks_per_step": ticks})
    speeds = [s.gait.stride / s.gait.ticks_per_step for s in (scenario, other)]
    assert speeds[0] == pytest.approx(speeds[1], rel=1e-12)
    assert other.mpc.horizon % other.gait.ticks_per_gait == 0


def test_the_middle_is_half_a_step() -> None:
    scenario = load_scenario("vhip")
    for ticks in (40, 33):
        middle = varied(scenario, {"ticks_per_step": ticks, "com_height_phase": "middle"})
        heights = [Gait(middle.gait).height(tick)[0] for tick in range(ticks)]
        assert abs(int(np.argmax(heights)) - ticks / 2) <= 0.5
        mirrored = [heights[-tick % ticks] for tick in range(ticks)]
        assert np.allclose(heights, mirrored, atol=1e-15)


def test_the_papers_own_pair_keeps_the_letter_of_equation_24() -> None:
    for name in ("paper_vhip", "paper_vhip_dcbf"):
        height = Gait(load_scenario(name).gait).height
        assert height(0)[0] == max(height(tick)[0] for tick in range(height.period))


def test_what_is_measured_is_what_the_log_holds() -> None:
    scenario = load_scenario("vhip", "{duration: 3.2}")
    log = simulate(scenario).after(1.6)
    found = steady_walk(scenario, log)
    assert found["h_min"] == {"forward_speed": pytest.approx(log["h"].min())}
    assert found["speed"] == pytest.approx(np.mean(log.element("lip_state", "vx")[:-1]), abs=1e-9)
    assert found["torque"] is None
    assert found["zmp_outside"] == 0.0
    moved = dict(log.signals) | {"lip_state": log["lip_state"] + [0, 0, 1.0, 0, 0, 0]}
    outside = steady_walk(scenario, RunLog(moved, log.time, log.ending))
    assert outside["zmp_outside"] == 1.0
    assert outside["zmp_beyond"] > 0.9


def test_a_gait_that_can_not_be_walked_is_a_result() -> None:
    scenario = load_scenario("vhip")
    (work,) = plan(scenario, {"com_height_amplitude": [0.03]}, {})
    assert measure(work).speed is not None
    bad = scenario.model_copy(update={"gait": scenario.gait.model_copy(update={"com_height_amplitude": 0.04})})
    found = measure(Work({"com_height_amplitude": 0.04}, bad.model_dump_json()))
    assert "com_height_amplitude" in found.ending
    assert found.speed is None


def test_every_combination_is_measured_once() -> None:
    work = plan(load_scenario("vhip"), {"com_height": [0.5, 0.6]}, {"com_height": [0.5], "com_height_phase": [0, 9]})
    assert [piece.values for piece in work] == [
        {"com_height": 0.5}, {"com_height": 0.6},
        {"com_height": 0.5, "com_height_phase": 0}, {"com_height": 0.5, "com_height_phase": 9},
    ]  # fmt: skip


def test_what_can_not_be_varied_is_refused() -> None:
    with pytest.raises(InputError, match=r"gait\.swing_height can't be varied here; these can: com_height_phase"):
        gait_study(load_scenario("vhip"), lines={"swing_height": [0.1]})
    with pytest.raises(InputError, match="walk without an end"):
        gait_study(load_scenario("vhip", "gait: {walk_steps: 3}"))
    with pytest.raises(InputError, match="only a 'biped' can be pushed"):
        gait_study(load_scenario("vhip"), directions=["+x"])


def test_the_command_writes_table_map_and_lines(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--vary", "com_height_phase=0,20", "--over", "com_height=0.57,0.58", "--over", "double_support_ticks=4"]
    assert main(["gait", "vhip", *words, "--workers", "1", "--out", str(tmp_path / "g")]) == 0
    data = json.loads((tmp_path / "g" / "gait.json").read_text())
    assert [gait["values"] for gait in data["gaits"]][:2] == [{"com_height_phase": 0}, {"com_height_phase": 20}]
    written = {path.name for path in (tmp_path / "g").iterdir()}
    assert {"gait.txt", "gait_lines.png", "gait_map.png", "scenario.yaml"} <= written
    assert "com_height_phase 20" in capsys.readouterr().out


def test_a_wrong_value_list_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["gait", "vhip", "--vary", "com_height=tall"]) == 1
    assert "--vary: KEY=LIST with one of com_height_phase" in capsys.readouterr().err
