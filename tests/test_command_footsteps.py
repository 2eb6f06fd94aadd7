"""Footsteps of walks that follow commands: their headings, their symmetry, and soles that stay apart."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from pdhocbf_drake.mpc.commanded import CommandedSteps
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.terms.step_limits import step_ranges
from pdhocbf_drake.walking.command_limits import Limits
from pdhocbf_drake.walking.commanded_walk import CommandedFootsteps
from pdhocbf_drake.walking.commands import STOP, Command, Schedule
from pdhocbf_drake.walking.config import GaitConfig
from pdhocbf_drake.walking.frame import rotation
from pdhocbf_drake.walking.gait import Gait
from pdhocbf_drake.walking.sides import BOTH
from pdhocbf_drake.walking.sole_gap import Pose, sole_gap, sole_gaps

GAIT = GaitConfig()
SOLE = (0.1, 0.06)
STEP = GAIT.ticks_per_step * GAIT.tick
ORIGIN = Pose(0.0, 0.0, 0.0)


def footsteps(*commands: tuple[float, Command], start: Pose = ORIGIN, gait: GaitConfig = GAIT):
    times, values = zip(*commands, strict=True)
    return CommandedFootsteps.of(gait, Schedule(times, values), start, Limits(sole=SOLE))


# Footsteps.


def test_a_constant_forward_command_gives_the_footsteps_of_the_stride() -> None:
    straight = Gait(GAIT)
    walk = Gait(GAIT, footsteps((0.0, Command(GAIT.stride / STEP))))
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
