"""Walks that follow commands: the template in the stance frame, stops and starts, bad input, and paths."""

from __future__ import annotations

import math
from itertools import pairwise

import hypothesis
import numpy as np
import pytest
from hypothesis.strategies import booleans, floats, integers, tuples

from pdhocbf_drake import certify
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.loop import walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.simulation.build import Walk, build_walk
from pdhocbf_drake.simulation.checks import check_scenario
from pdhocbf_drake.simulation.commands import limited_commands
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.walking.commanded_walk import CommandedFootsteps
from pdhocbf_drake.walking.config import GaitConfig
from pdhocbf_drake.walking.frame import rotation
from pdhocbf_drake.walking.gait import Gait
from pdhocbf_drake.walking.sides import BOTH
from pdhocbf_drake.walking.sole_gap import Pose
from pdhocbf_drake.walking.waypoints import distance_to

GAIT = GaitConfig()
STEP = GAIT.ticks_per_step * GAIT.tick
SEQUENCE = [
    {"time": 0.0, "velocity": [0.375, 0.0]},
    {"time": 2.0, "velocity": [0.2, 0.1], "turn": 0.5},
    {"time": 4.5, "stop": True},
    {"time": 6.3, "velocity": [-0.2, -0.05], "turn": -0.4},
]


def commanded(commands: list[dict], start: dict | None = None, gait: dict | None = None) -> Walk:
    base = load_scenario("vhip_nobarrier").to_dict()
    data = {**base, "commands": commands, "start": start or {}, "gait": {**base["gait"], **(gait or {})}}
    return build_walk(Scenario.from_dict(data, "commands"))


def template(walk: Walk, ticks: int) -> list:
    return list(walk_template(walk.mpc, Memory.standing(walk.mpc), 0, ticks))


def seen(walk: Walk, rows: list) -> np.ndarray:
    """States from the stance foot along its heading, (T, 2, 3)."""
    yaws = [walk.gait.step(row.tick // walk.gait.period).yaw for row in rows]
    away = [row.state - row.before.stance[:, 1:] * [1.0, 0.0, 1.0] for row in rows]
    return np.array([rotation(-yaw) @ state for yaw, state in zip(yaws, away, strict=True)])


# The template in the frame of its stance foot.


@pytest.fixture(scope="module")
def turning() -> tuple[Walk, list]:
    walk = commanded([{"time": 0.0, "velocity": [0.3, 0.0], "turn": 0.75}])  # 0.3 rad a step
    return walk, template(walk, 34 * 40)


def test_a_turning_walk_recurs_in_the_stance_frame_and_not_in_the_world(turning: tuple[Walk, list]) -> None:
    walk, rows = turning
    states = seen(walk, rows)[28 * 40 :]
    np.testing.assert_allclose(states[:80], states[80:160], atol=1e-9)
    speeds = np.array([row.state[0, 1] for row in rows[28 * 40 :]])
    assert np.abs(speeds[:80] - speeds[80:160]).max() > 0.05
    assert {row.plan.reason.name for row in rows} == {"SOLVED"}


def test_the_zmp_of_a_turning_walk_stays_in_the_true_box_of_its_foot(turning: tuple[Walk, list]) -> None:
    walk, rows = turning
    single = [i for i, row in enumerate(rows) if row.tick > 120 and row.tick % 40 > 4]
    away = np.abs(seen(walk, rows)[single][:, :, 2])
    assert np.all(away <= np.array(walk.gait.config.zmp_box) / 2.0 + 1e-9)


@pytest.mark.parametrize("yaw", [math.pi / 2, math.pi, 1.1])
def test_the_template_walks_alike_from_anywhere(yaw: float) -> None:
    here = commanded(SEQUENCE)
    there = commanded(SEQUENCE, {"position": [100.0, -40.0], "yaw": yaw})
    one = np.array([row.state for row in template(here, 800)])
    other = np.array([row.state for row in template(there, 800)])
    moved = rotation(yaw) @ one + np.array([[100.0, 0.0, 100.0], [-40.0, 0.0, -40.0]])
    np.testing.assert_allclose(other, moved, atol=1e-8)


@hypothesis.settings(max_examples=25)
@hypothesis.given(
    yaw=floats(-4.0, 4.0), place=tuples(floats(-90.0, 90.0), floats(-90.0, 90.0)), i=integers(200, 1000),
    seed=integers(0, 1000), recovering=booleans(),
)  # fmt: skip
def test_a_plan_is_the_same_from_any_place_and_heading(
    turning: tuple[Walk, list], yaw: float, place: tuple[float, float], i: int, seed: int, recovering: bool
) -> None:
    """From a disturbed state, an expected ZMP offset and the last plan with its active set."""
    walk, rows = turning
    draw = np.random.default_rng(seed)
    row, last = rows[i], rows[i - 1].plan
    state, offset = row.state + draw.normal(size=(2, 3)) * [1e-3, 0.02, 1e-3], draw.normal(size=(2, 80)) * 2e-3
    line = walk.gait.footsteps.line
    moved = CommandedFootsteps.of(GAIT, lambda time: line.asked(0), Pose(*place, yaw), line.limits)
    other = walk.mpc.walking(lambda gait: Gait(gait.config, moved))
    turn, away = rotation(yaw), np.array(place)[:, None]
    there = last._replace(inputs=turn @ last.inputs, footholds=turn @ last.footholds + away)
    arguments = state, row.before.stance, {}, offset, last, recovering
    one = walk.mpc.solve(row.tick, *arguments)
    found = other.solve(
        row.tick, turn @ state + away * [1.0, 0.0, 1.0], turn @ row.before.stance + away, {}, turn @ offset, there,
        recovering,
    )  # fmt: skip
    assert found.reason == one.reason
    np.testing.assert_allclose(found.inputs, turn @ one.inputs, atol=1e-7)
    np.testing.assert_allclose(found.footholds, turn @ one.footholds + away, atol=1e-9)
    assert [np.flatnonzero(a).tolist() for a in found.active] == [np.flatnonzero(a).tolist() for a in one.active]


def test_mirrored_commands_give_the_mirrored_walk() -> None:
    mirrored = [
        {**c, "velocity": [c["velocity"][0], -c["velocity"][1]], "turn": -c.get("turn", 0.0)} if "velocity" in c else c
        for c in SEQUENCE
    ]
    one = np.array([row.state for row in template(commanded(SEQUENCE), 800)])
    other = np.array([row.state for row in template(commanded(mirrored, gait={"first_stance": "left"}), 800)])
    np.testing.assert_allclose(other * [[1.0], [-1.0]], one, atol=1e-8)


def test_the_template_stops_and_starts_as_often_as_commanded() -> None:
    walks = [{"time": 4.0 * i, "turn": 0.5, "velocity": [0.3, 0.0]} for i in range(5)]
    stops = [{"time": 4.0 * i + 2.0, "stop": True} for i in range(5)]
    walk = commanded(sorted([*walks, *stops], key=lambda command: command["time"]))
    rows = template(walk, 2000)
    assert max(row.plan.fallbacks for row in rows) == 0
    for i in range(5):
        assert walk.gait.support(int((4.0 * i + 3.9) / STEP)) == BOTH
        assert np.abs(rows[round(100 * (4.0 * i + 3.95))].state[:, 1]).max() < 0.02


@pytest.mark.parametrize("offset", [0.0, 0.13, 0.4, 0.41, 0.77])
def test_a_stop_at_any_tick_stands_after_two_more_steps_and_starts_again(offset: float) -> None:
    stops = 3.6 + offset, 8.4 + offset
    commands = [
        {"time": 0.0, "velocity": [0.3, 0.05], "turn": 0.4},
        {"time": stops[0], "stop": True},
        {"time": 6.4, "velocity": [-0.2, 0.0], "turn": -0.4},
        {"time": stops[1], "stop": True},
    ]
    walk = commanded(commands)
    rows = template(walk, 1200)
    assert {row.plan.reason.name for row in rows} == {"SOLVED"}
    for stop, rest in zip(stops, (635, 1199), strict=True):
        taken_up = math.ceil(stop / STEP - 1e-9)
        assert walk.gait.support(taken_up + 1) != BOTH
        assert [walk.gait.support(taken_up + i) for i in (2, 3, 4)] == [BOTH] * 3
        assert np.abs(rows[rest].state[:, 1]).max() < 0.01


@pytest.mark.parametrize("delay", [0.1, 0.5, 0.9, 1.3])
def test_a_walk_that_begins_while_the_robot_steps_in_place_of_a_stand_goes_on_with_the_other_foot(delay: float) -> None:
    data = load_scenario("walking_nobarrier").to_dict()
    commands = [{"time": 0.0, "stop": True}, {"time": 2.0 + delay, "velocity": [0.2, 0.05], "turn": 0.3}]
    walk = build_walk(Scenario.from_dict({**data, "commands": commands}, "resumed"))
    kicks = np.zeros((201, 2))
    kicks[200] = 0.5, 0.2
    rows = list(walk_template(walk.mpc, Memory.standing(walk.mpc), 0, 700, kicks))
    sides = [row.memory.problem(walk.mpc).gait.support(row.tick // 40) for row in rows[::40]]
    assert rows[250].memory.resumed.tick == 200
    assert all(one != other for one, other in pairwise(sides[5:]) if one)
    assert np.abs(rows[-1].state[:, 1]).max() < 0.5


# Bad input.


def load(text: str) -> Scenario:
    scenario = load_scenario("vhip", text)
    check_scenario(scenario)
    return scenario


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("commands: [{time: 1, turn: 0.1}, {time: 1, turn: 0.2}]", r"commands\.1\.time: must be later than .* 1 s"),
        ("commands: [{time: 2, turn: 0.1}, {time: 1, turn: 0.2}]", r"commands\.1\.time: must be later than .* 2 s"),
        ("commands: [{time: .nan, turn: 0.1}]", "commands.0.time"),
        ("commands: [{time: 0, velocity: [.nan, 0]}]", "commands.0.velocity"),
        ("commands: [{time: 0, velocity: [0.1, 0], stop: true}]", "neither a velocity nor a turn rate"),
        ("commands: [{time: 0}]", "needs a velocity"),
        ("{commands: [{time: 0, turn: 0.1}], gait: {walk_steps: 3}}", "gait.walk_steps: must be null"),
        ("start: {position: [1e6, 0]}", "start.position"),
    ],
)
def test_contradictions_are_refused_with_their_key(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load(text)


def test_a_run_says_which_commands_were_granted_in_part() -> None:
    scenario = load("commands: [{time: 0, velocity: [0.3, 0]}, {time: 3, velocity: [5, 0], turn: 9}]")
    (sentence,) = limited_commands(scenario)
    assert "the command at 3 s is granted in part" in sentence
    assert "of [5, 0] m/s and 9 rad/s" in sentence


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{path: [[1, 0]], commands: [{time: 0, turn: 0.1}]}", "path: must be empty where there are commands"),
        ("{path: [[1, 0]], path_speed: 5}", r"path_speed: must be at most 0\.575 m/s"),
        ("path_speed: 0.2", "path_speed: is the speed along a path, and there is none"),
        ("path: [[1, .nan]]", r"path\.0\.1"),
    ],
)
def test_paths_that_contradict_are_refused(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        build_walk(load(text))


@pytest.mark.parametrize("key", ["commands: [{time: 0, turn: 0.1}]", "path: [[1, 0]]"])
def test_studies_of_straight_walks_refuse_others(key: str) -> None:
    with pytest.raises(InputError, match=r"must be empty here, where the walk straight ahead"):
        certify(load(key))


# Waypoints.

SQUARE = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0), (0.0, 0.0)]
WAVE = [(0.1 * i, 0.5 * math.sin(0.1 * math.pi * i)) for i in range(21)]


@pytest.mark.parametrize("yaw", [0.0, 2.0])
@pytest.mark.parametrize("points", [SQUARE, WAVE, [(-1.0, 0.0)], [(0.0, 0.0), (0.0, 0.0), (0.5, 0.5)]])
def test_a_path_is_kept_and_ends_at_a_stand_on_its_last_point(points: list, yaw: float) -> None:
    data = {"path": points, "start": {"yaw": yaw}, "duration": 100.0}
    gait = build_walk(Scenario.from_dict({**load_scenario("vhip_nobarrier").to_dict(), **data}, "path")).gait
    paths = np.array([gait.path(step)[:2] for step in range(240)])
    assert distance_to([(0.0, 0.0), *points], paths).max() < 0.03
    assert np.linalg.norm(paths[-1] - points[-1]) < 0.015
    assert gait.support(239) == BOTH
