"""Walks that follow commands: footsteps with yaw, their limits and symmetry, the template in the stance frame."""

from __future__ import annotations

import math
from itertools import pairwise

import hypothesis
import numpy as np
import pytest
from hypothesis.strategies import booleans, floats, integers, tuples

from pdhocbf_drake import certify
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.commanded import CommandedSteps
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.loop import walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.terms.step_limits import step_ranges
from pdhocbf_drake.simulation.build import Walk, build_walk
from pdhocbf_drake.simulation.checks import check_scenario
from pdhocbf_drake.simulation.commands import limited_commands
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.walking.command_limits import Limits
from pdhocbf_drake.walking.commanded_walk import CommandedFootsteps
from pdhocbf_drake.walking.commands import STOP, Command, Schedule
from pdhocbf_drake.walking.config import GaitConfig
from pdhocbf_drake.walking.frame import rotation
from pdhocbf_drake.walking.gait import Gait
from pdhocbf_drake.walking.sides import BOTH
from pdhocbf_drake.walking.sole_gap import Pose, sole_gap, sole_gaps
from pdhocbf_drake.walking.waypoints import distance_to

GAIT = GaitConfig()
SOLE = (0.1, 0.06)
STEP = GAIT.ticks_per_step * GAIT.tick
ORIGIN = Pose(0.0, 0.0, 0.0)
SEQUENCE = [
    {"time": 0.0, "velocity": [0.375, 0.0]},
    {"time": 2.0, "velocity": [0.2, 0.1], "turn": 0.5},
    {"time": 4.5, "stop": True},
    {"time": 6.3, "velocity": [-0.2, -0.05], "turn": -0.4},
]


def footsteps(*commands: tuple[float, Command], start: Pose = ORIGIN, gait: GaitConfig = GAIT):
    times, values = zip(*commands, strict=True)
    return CommandedFootsteps.of(gait, Schedule(times, values), start, Limits(sole=SOLE))


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


# Footsteps.


def test_a_constant_forward_command_gives_the_footsteps_of_the_stride() -> None:
    straight = build_walk(load_scenario("vhip_nobarrier")).gait
    walk = commanded([{"time": 0.0, "velocity": [straight.config.stride / STEP, 0.0]}]).gait
    for step in range(-3, 30):
        (*place, slope, window), (*other, level, anywhere) = walk.step(step), straight.step(step)
        np.testing.assert_allclose(place, other, atol=1e-12)
        assert (slope, window) == (level, anywhere)


@pytest.mark.parametrize("command", [Command(0.3, 0.0, 0.5), Command(-0.2, 0.1, -0.3), Command(0.0, -0.12, 0.0)])
def test_the_middle_of_the_feet_moves_at_the_commanded_velocity_and_turn_rate(command: Command) -> None:
    walk = footsteps((0.0, command))
    (x, y, yaw, *_), (x2, y2, yaw2, *_) = walk.path(10), walk.path(12)
    assert yaw2 - yaw == pytest.approx(2.0 * STEP * command.turn)
    # The chord of an arc of constant velocity, along the heading in its middle.
    half = 0.5 * (yaw + yaw2)
    chord = rotation(-half) @ np.array([x2 - x, y2 - y])
    assert chord[0] == pytest.approx(2.0 * STEP * command.forward, abs=0.01)
    assert chord[1] == pytest.approx(2.0 * STEP * command.lateral, abs=0.015)


def test_feet_alternate_and_a_stop_has_two_more_steps() -> None:
    walk = footsteps((0.0, Command(0.3, 0.0, 0.4)), (4.01, STOP), (8.0, Command(0.0, 0.1, 0.0)))
    sides = [walk[step].side for step in range(0, 40)]
    assert sides[:2] == [BOTH, BOTH]
    first = next(j for j in range(2, 40) if sides[j] == BOTH)
    taken_up = math.ceil(4.01 / STEP)
    assert first == taken_up + 2
    assert all(one == -other for one, other in pairwise(sides[2:first]))
    again = next(j for j in range(first, 40) if sides[j] != BOTH)
    assert again == round(8.0 / STEP) + 1
    assert sides[again] == -1  # the left foot leads to the left


def test_what_a_step_expects_comes_true_under_one_command_and_is_not_known_before_a_change() -> None:
    walk = footsteps((0.0, Command(0.3, 0.0, 0.4)), (4.0, Command(0.1, 0.0, -0.4)))
    for known in range(0, 25):
        expected = walk.seen(known)
        for step in range(known - 2, known + 2):
            assert expected[step] == walk[step]
    assert walk.seen(5)[8] == walk[8]
    assert walk.seen(9)[12] != walk[12]
    assert not walk.settled(10)
    assert walk.settled(11)


@pytest.mark.parametrize("yaw", [0.3, math.pi / 2, math.pi, -2.5])
def test_footsteps_move_and_turn_with_the_start(yaw: float) -> None:
    commands = [(0.0, Command(0.3, 0.1, 0.4)), (4.0, STOP), (6.0, Command(-0.2, 0.0, -0.3))]
    here, there = footsteps(*commands), footsteps(*commands, start=Pose(100.0, -30.0, yaw))
    for step in range(-1, 25):
        one, other = here[step], there[step]
        place = rotation(yaw) @ [one.x, one.y] + [100.0, -30.0]
        np.testing.assert_allclose([other.x, other.y, other.yaw], [*place, one.yaw + yaw], atol=1e-11)
        assert (one.side, one.start) == (other.side, other.start)


def test_mirrored_commands_give_mirrored_footsteps() -> None:
    commands = [Command(0.3, 0.0, 0.0), Command(0.2, 0.1, 0.4), Command(0.0, -0.1, 0.3)]
    times = [0.0, 2.0, 5.0]
    one = footsteps(*zip(times, commands, strict=True))
    mirrored = [Command(c.forward, -c.lateral, -c.turn) for c in commands]
    gait = GAIT.model_copy(update={"first_stance": "left"})
    other = footsteps(*zip(times, mirrored, strict=True), gait=gait)
    for step in range(-1, 25):
        a, b = one[step], other[step]
        np.testing.assert_allclose([a.side, a.x, a.y, a.yaw], [-b.side, b.x, -b.y, -b.yaw], atol=1e-12)


# Limits.


@pytest.mark.parametrize("seed", range(20))
def test_soles_of_any_granted_command_stay_apart(seed: int) -> None:
    random = np.random.default_rng(seed)
    command = Command(*random.uniform([-2.0, -1.0, -3.0], [2.0, 1.0, 3.0]).tolist())
    granted = Limits(sole=SOLE).granted(command, GAIT)
    walk = footsteps((0.0, command))
    feet = [Pose(*walk[step][1:4]) for step in range(4, 12)]
    assert min(sole_gap(a, b, SOLE) for a, b in pairwise(feet)) > 0.01
    assert Limits(sole=SOLE).granted(granted, GAIT) == pytest.approx(granted, abs=1e-3)
    assert abs(granted.turn) <= abs(command.turn)
    assert granted.forward * command.lateral == pytest.approx(granted.lateral * command.forward)


@pytest.mark.parametrize("seed", range(40))
def test_soles_stay_apart_whatever_commands_follow_each_other(seed: int) -> None:
    random = np.random.default_rng(seed)
    drawn = random.uniform([-0.6, -0.3, -1.5], [0.6, 0.3, 1.5], size=(20, 3)).tolist()
    commands = [Command(*values) if random.random() < 0.8 else STOP for values in drawn]
    walk = footsteps(*((STEP * i * (1 + seed % 4), command) for i, command in enumerate(commands)))
    feet = [walk[step] for step in range(2, 40)]
    for last, here, following in zip(feet, feet[1:], feet[2:], strict=False):
        if BOTH in (last.side, here.side, following.side):
            continue
        start, stance, end = (Pose(*foot[1:4]) for foot in (last, here, following))
        assert sole_gap(stance, end, SOLE) > 0.0199
        for share in np.linspace(0.05, 0.95, 19):
            way = Pose(*(a + share * (b - a) for a, b in zip(start, end, strict=True)))
            assert sole_gap(way, stance, SOLE) > 0.01


def test_sharp_turns_have_wider_steps_and_the_middle_between_the_feet_keeps_its_path() -> None:
    walk, narrow = footsteps((0.0, Command(0.3, 0.0, 0.75))), footsteps((0.0, Command(0.3, 0.0, 0.3)))
    assert walk.aside(10) > narrow.aside(10) == GAIT.stance_width / 2.0
    both = CommandedFootsteps.of(GAIT, Schedule([0.0], [Command(0.3, 0.0, 0.75)]), ORIGIN, Limits())
    np.testing.assert_allclose(walk.path(12), both.path(12), atol=1e-12)


@pytest.mark.parametrize("seed", range(30))
def test_footholds_within_the_limits_of_a_step_keep_the_soles_apart(seed: int) -> None:
    random = np.random.default_rng(seed)
    command = Command(*random.uniform([-0.4, -0.15, -0.75], [0.4, 0.15, 0.75]).tolist())
    walk = footsteps((0.0, command))
    commanded = CommandedSteps(Gait(GAIT, walk), 80, 0.0).steps(8)
    for reach in (None, (0.45, 0.5)):
        config = MpcConfig(step_reach=reach)
        lower, upper = step_ranges(config, commanded)
        # Within a reach each foothold is as far aside as one anywhere needs to be, more than some are commanded.
        wider, gap = (0.0, 0.0199) if reach is None else (0.02, 0.0119)
        assert np.all(lower <= commanded.moves + wider + 1e-12) and np.all(commanded.moves <= upper + wider + 1e-12)
        assert np.all(lower <= upper)
        here, following = commanded.steps[:2]
        for x in np.linspace(lower[0, 0], upper[0, 0], 9):
            for y in np.linspace(lower[1, 0], upper[1, 0], 9):
                foot = Pose(0.0, 0.0, 0.0), Pose(x, y, following.yaw - here.yaw)
                assert sole_gap(*foot, SOLE) > gap


@pytest.mark.parametrize("turn", [0.1, 0.4, -0.75])
def test_a_disturbed_walk_that_turns_may_step_as_far_back_and_ahead_as_one_that_does_not(turn: float) -> None:
    reach = (0.45, 0.5)
    commanded = CommandedSteps(Gait(GAIT, footsteps((0.0, Command(0.3, 0.0, turn)))), 80, 0.0)
    for step in (8, 9):
        lower, upper = step_ranges(MpcConfig(step_reach=reach), commanded.steps(step))
        assert (lower[0, 0], upper[0, 0]) == (-reach[0], reach[0])


def test_possible_commands_are_granted_as_they_are() -> None:
    for command in (Command(0.375, 0.0, 0.5), Command(-0.2, 0.12, 0.45), Command(0.0, 0.0, 0.5), STOP):
        assert Limits(sole=SOLE).granted(command, GAIT) == command


def test_the_gap_of_turned_rectangles() -> None:
    assert sole_gap(Pose(0.0, 0.0, 0.0), Pose(0.05, 0.16, 0.0), SOLE) == pytest.approx(0.04)
    assert sole_gap(Pose(0.0, 0.0, 0.3), Pose(0.0, 0.1, 0.0), SOLE) < 0.0
    poses = np.random.default_rng(0).uniform(-0.3, 0.3, size=(2, 50, 3))
    gaps = sole_gaps(*poses, np.array(SOLE))
    for one, other, gap in zip(*poses, gaps, strict=True):
        assert sole_gap(Pose(*one), Pose(*other), SOLE) == pytest.approx(gap)


def test_a_foothold_at_the_edge_of_what_a_sharp_turn_allows_can_still_be_moved() -> None:
    steps = CommandedSteps(Gait(GAIT, footsteps((0.0, Command(0.3, 0.0, 0.75)))), 80, 0.0)
    for step in (8, 9):  # the foot outside the turn comes as close to the other one as it may
        lower, upper = step_ranges(MpcConfig(), steps.steps(step))
        assert np.all((upper - lower)[:, 1] > 0.02)


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
