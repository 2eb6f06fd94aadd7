"""The benchmark measures the named quantities; no test depends on the speed of this machine."""

from __future__ import annotations

import argparse
import json
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import make_diagram
from pdhocbf_drake.studies.bench import benchmark, command, loops, own_tick, startup
from pdhocbf_drake.studies.bench.bare_plant import bare_plant, replayed_plant
from pdhocbf_drake.studies.bench.benchmark import Effort
from pdhocbf_drake.studies.bench.block_clock import block_clock
from pdhocbf_drake.studies.bench.recording import record
from pdhocbf_drake.systems.gait_reference import GaitReference

SHORT = "{gait: {ticks_per_step: 20, tick: 0.02}, mpc: {horizon: 40}}"
TINY = Effort(20, 2, False, 4, 40, 0.2, 1.0, (0.001,), 0.2, 1.0, ((40, 40),), 1)

_STEPS = [
    {"plant_step": 0.001, "fell": False, "same_walk": True, "mean_speed": 0.37, "h_min": 0.01,
     "zmp_outside_fraction": 0.03, "com_rms_error": [0.01, 0.01, None], "controller_seconds_per_tick": 1e-3,
     "plant_seconds_per_tick": 1e-3, "real_time_factor": 5.0},
]  # fmt: skip
_ROBOT = {
    "plant_step": 1e-3, "robot_over_bare_plant": 2.0, "replayed_over_bare_plant": 1.2, "replayed_over_robot": 0.6,
    "blocks_over_fused": 1.1, "loop_seconds_per_tick": 2e-3, "blocks_seconds_per_tick": 2.2e-3,
    "bare_plant_seconds_per_tick": 1e-3, "replayed_plant_seconds_per_tick": 1.2e-3,
    "python_calls_per_tick": 500.0, "kinematics_seconds_per_tick": 1e-4,
    "blocks": {"PeriodicMpc": 1e-4, "plant and framework": 1e-3},
}  # fmt: skip

_STARTS = {"import_drake_seconds": 1.0, "ready_seconds": 2.5, "prepared_seconds": 3.5}


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """A short gait for the ticks; loops, which have their own tests, are taken as measured."""
    monkeypatch.setattr(benchmark, "load_scenario", lambda name: load_scenario(name, SHORT if name == "vhip" else ""))
    monkeypatch.setattr(own_tick, "TIMED", 20)
    template = {"simulated_seconds": 1.0, "wall_seconds": 0.1, "real_time_factor": 10.0, "framework_share": 0.5}
    monkeypatch.setattr(loops, "template_loop", lambda *_: template)
    monkeypatch.setattr(loops, "robot_loop", lambda *_: _ROBOT)
    monkeypatch.setattr(loops, "plant_steps", lambda *_: _STEPS)
    monkeypatch.setattr(startup, "start_up", lambda *_: _STARTS)
    monkeypatch.setattr(startup, "resident_growth", lambda *_: 0.0)


def test_all_numbers_are_written_and_printed(
    small: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(benchmark, "QUICK", TINY)
    place = tmp_path / "bench.json"
    options = argparse.Namespace(quick=True, json=place)
    assert command.run(options) == 0
    written = json.loads(place.read_text())
    assert {"stock_over_ours_nominal", "stock_over_ours_perturbed", "ours_over_core", "p99_over_median",
            "robot_over_bare_plant", "template_real_time_factor"} <= set(written["ratios"])  # fmt: skip
    assert {"relative_gap_max", "violation_max", "non_optimal_exits"} <= set(written["accuracy"])
    assert {"horizon", "tick_seconds_median"} <= set(written["growth"][0])
    assert all(value > 0 for value in written["ratios"].values())
    assert written["accuracy"]["relative_gap_max"] < 1e-9
    assert written["accuracy"]["violation_max"] < 1e-7
    assert written["accuracy"]["references_certain"] == written["accuracy"]["references"]
    assert {path.name for path in tmp_path.iterdir()} == {"bench.json", "bench_routes.png", "bench_growth.png"}
    printed = capsys.readouterr().out
    for name in ("ours", "solver core", "Drake rebuilt", "Drake updated", "stock_over_ours_nominal", "≥ 20"):
        assert name in printed
    lines = {" ".join(line.split()) for line in printed.splitlines()}
    assert "1 ms 2000 2200 1200 1000" in lines
    assert {"PeriodicMpc 100 0.09091", "plant and framework 1000 0.9091", "all 1100 1"} <= lines
    assert "1 ms yes 0.37 0.01 0.03 1 1 5" in lines
    assert "500 calls from Python a tick; kinematics and dynamics of the robot take 100 µs of it" in lines
    assert "resident set grew by 0.00 MB in the walk" in printed
    docs = Path(__file__).parents[1] / "docs"
    script, page = runpy.run_path(str(docs / "speed.py")), (docs / "speed.md").read_text(encoding="utf-8")
    renewed = script["with_tables"](page, written)
    assert "| 1 ms | 2000 | 2200 | 1200 | 1000 | 0.60 |" in renewed
    assert "| 1 ms | yes | 0.370 | 10 | 3.0 % | 5 |" in renewed
    assert script["with_tables"](renewed, written) == renewed
    for name in script["TABLES"]:
        assert renewed.count(f"<!-- {name} -->\n\n| ") == renewed.count(f" |\n\n<!-- end of {name} -->") == 1


def test_a_folder_that_is_not_there_is_refused_before_anything_is_measured(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        command.run(argparse.Namespace(quick=True, json=tmp_path / "none" / "bench.json"))


def test_without_daqp_the_benchmark_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(benchmark, "has_daqp", lambda: False)
    with pytest.raises(InputError, match="pip install daqp"):
        benchmark.measure(TINY, lambda _: None)


def test_recordings_are_reproducible_and_only_perturbed_ones_are_disturbed() -> None:
    walk = build_walk(load_scenario("vhip", SHORT))
    calm, once, twice = record(walk, 60, False), record(walk, 60, True, 1), record(walk, 60, True, 1)
    assert len(calm.ticks) == 60
    assert set(calm.reasons) == {Reason.SOLVED}
    assert all(np.array_equal(a.state, b.state) for a, b in zip(once.ticks, twice.ticks, strict=True))
    assert not np.allclose(once.ticks[-1].state, calm.ticks[-1].state)


def test_the_bare_plant_stands_still() -> None:
    from pydrake.systems.analysis import Simulator

    scenario = load_scenario("walking_nobarrier", SHORT)
    diagram = bare_plant(scenario, build_walk(scenario), Biped.load(scenario.robot))
    simulator = Simulator(diagram)
    simulator.AdvanceTo(1.0)
    plant = diagram.GetSubsystemByName("plant")
    state = plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(simulator.get_context()))
    assert np.abs(state[19:]).max() < 0.05


def test_a_replayed_plant_walks_as_it_was_recorded() -> None:
    from pydrake.systems.analysis import Simulator

    scenario = load_scenario("walking_nobarrier", "plant: {time_step: 0.001}")
    logged = make_diagram(scenario)
    recording = Simulator(logged.diagram)
    recording.AdvanceTo(1.0)  # into the first step
    log = logged.recorded(recording.get_context())
    diagram = replayed_plant(scenario, build_walk(scenario), Biped.load(scenario.robot), log)
    simulator, plant = Simulator(diagram), diagram.GetSubsystemByName("plant")
    for row in (40, 99):
        simulator.AdvanceTo(log.time[row] - 5e-4)
        state = plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(simulator.get_context()))
        np.testing.assert_array_equal(state, log["robot_state"][row])
    assert log["foot_state"][99, 2] + log["foot_state"][99, 8] > 0.01  # a foot was in the air


def test_blocks_add_up_to_the_whole_and_the_classes_are_put_back() -> None:
    before = PeriodicMpc.solve, dict(vars(GaitReference))
    parts = loops.blocks(load_scenario("vhip", SHORT), 0.4)
    assert (PeriodicMpc.solve, dict(vars(GaitReference))) == before
    assert {"PeriodicMpc", "MpcController", "GaitReference", "VhipPlant", "plant and framework"} <= set(parts)
    assert all(seconds > 0 for seconds in parts.values())
    with pytest.raises(RuntimeError), block_clock():
        raise RuntimeError
    assert (PeriodicMpc.solve, dict(vars(GaitReference))) == before


def test_calls_are_counted_and_the_robots_arithmetic_is_timed_apart() -> None:
    template = loops.calls(load_scenario("vhip", SHORT), 0.4)
    robot = loops.calls(load_scenario("walking_nobarrier", SHORT), 0.4)
    assert 50 < template["python_calls_per_tick"] < robot["python_calls_per_tick"]
    assert template["kinematics_seconds_per_tick"] == 0.0 < robot["kinematics_seconds_per_tick"]


def test_the_growth_exponent_is_that_of_a_power() -> None:
    rows = [{"horizon": h, "ticks_per_gait": 80, "tick_seconds_median": 1e-6 * h**1.5} for h in (80, 160, 320)]
    assert own_tick.exponent(rows, 80) == pytest.approx(1.5)


def test_a_walk_is_the_same_only_if_nothing_got_worse() -> None:
    first = _STEPS[0]
    assert loops.same_walk(first, first)
    for change in (
        {"mean_speed": 0.30},
        {"h_min": 0.0},
        {"zmp_outside_fraction": 0.06},
        {"com_rms_error": [0.02, 0, None]},
    ):
        assert not loops.same_walk(first, {**first, **change})


def test_resident_growth_is_a_difference_however_short_the_walk() -> None:
    grown = startup.resident_growth(load_scenario("vhip", SHORT), 2.0, 0.4)
    assert abs(grown) < 0.5 * startup.resident_bytes()


def test_a_walk_and_the_benchmarks_refusal_need_no_daqp() -> None:
    code = (
        "import sys; sys.modules['daqp'] = None\n"
        "from pdhocbf_drake.simulation.scenario_file import load_scenario\n"
        "from pdhocbf_drake.simulation.simulate import simulate\n"
        "text = '{duration: 0.3, gait: {ticks_per_step: 20, tick: 0.02}, mpc: {horizon: 40}}'\n"
        "log = simulate(load_scenario('vhip_nobarrier', text))\n"
        "assert log.ending == 'finished' and log['solver_status'][:, 0].min() == 1.0\n"
        "from pdhocbf_drake.studies.bench import benchmark\n"
        "try:\n"
        "    benchmark.measure(benchmark.QUICK, print)\n"
        "except benchmark.InputError as error:\n"
        "    print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "daqp is not installed" in done.stdout
