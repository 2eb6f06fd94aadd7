"""Bipeds of any size walk with nothing edited: copies of the packaged one, and generated ones."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Collection
from pathlib import Path

import bipeds
import pytest
from sound_walks import OTHER_WALKS, check_sound, check_walked, other_walk

from pdhocbf_drake.analysis.metrics import compute_metrics
from pdhocbf_drake.analysis.metrics_schema import Metrics
from pdhocbf_drake.analysis.robot_limits import robot_limits
from pdhocbf_drake.fitting.walk_checks import motion_findings
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.limits import within_its_limits
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate

SHAPES = {f"{size} of the packaged biped": bipeds.resized(size) for size in (0.3, 0.5, 1.5, 1.8)}
SHAPES |= {f"generated {seed}": bipeds.random_shape(seed) for seed in range(10)}
SHAPES |= {"wide hips and narrow soles": bipeds.narrow()}
GAITS = 9  # walked, after a standing start
EVERY = "PDHOCBF_ROBOTS" in os.environ  # walks for which the tests of every day have no time
SEEDS, WALKS = (range(10), OTHER_WALKS) if EVERY else ((2,), ("push y 2/4",))


def walked(folder: Path, shape: bipeds.Shape, text: str = "", levels: Collection[str] = ("ok",)) -> Metrics:
    """A walk of some seconds with the defaults of `walking`."""
    robot = f"robot: {bipeds.write(folder, shape)}{text}"
    gait = load_scenario("walking", f"{{{robot}}}").gait
    duration = (gait.start_steps + 2 * GAITS) * gait.ticks_per_step * gait.tick
    scenario = load_scenario("walking", f"{{{robot}, duration: {duration:.3f}}}")
    assert [f for f in motion_findings(Biped.load(scenario.robot), scenario.gait) if f.level not in levels] == []
    return compute_metrics(scenario, simulate(scenario), 1.0, robot_limits(scenario))


@pytest.mark.parametrize("name", SHAPES)
def test_it_walks_with_nothing_edited(name: str, tmp_path: Path) -> None:
    found = walked(tmp_path, SHAPES[name])
    check_sound(found)


def test_a_lopsided_robot_learns_a_table_for_each_foot(tmp_path: Path) -> None:
    found = walked(tmp_path, dataclasses.replace(bipeds.resized(1.0), right=1.6))
    assert not found.fell
    assert found.zmp_outside_fraction is not None
    assert found.zmp_outside_fraction < 0.05  # 0.08 with one table for both
    assert found.barriers["forward_speed"].violations == 0


@pytest.mark.parametrize(("stride", "drift"), [(0.0, 0.008), (1.3, 0.01)])
def test_other_strides_than_the_robots_own(stride: float, drift: float, tmp_path: Path) -> None:
    """On the spot and in long steps the sway stays in the middle between the feet, and the soles keep their gap."""
    own = load_scenario("walking", f"{{robot: {bipeds.write(tmp_path, bipeds.narrow())}}}").gait
    found = walked(tmp_path, bipeds.narrow(), f", gait: {{stride: {stride * own.stride}}}", levels={"ok", "note"})
    assert not found.fell
    assert found.lateral_drift is not None
    assert found.lateral_drift < drift
    assert found.torque_limit_hits == 0
    assert found.mpc is not None
    assert found.mpc.degraded == {}
    assert found.barriers["forward_speed"].violations == 0


@pytest.mark.parametrize("walk", WALKS)
@pytest.mark.parametrize("seed", SEEDS)
def test_a_generated_robot_in_other_walks(seed: int, walk: str, tmp_path: Path) -> None:
    robot = {"robot": str(bipeds.write(tmp_path, bipeds.random_shape(seed)))}
    changes = robot | other_walk(load_scenario("walking", json.dumps(robot)), walk)
    scenario = within_its_limits(load_scenario("walking", json.dumps(changes)))
    check_walked(compute_metrics(scenario, simulate(scenario), 1.0, robot_limits(scenario)), walk)
