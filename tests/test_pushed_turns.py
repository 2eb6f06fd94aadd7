"""Walks that are pushed while they turn: where they go on, and how far apart they put their feet."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from pdhocbf_drake.mpc.loop import Measurement, TemplateTick, walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.simulation.build import Walk, build_walk
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.walking.command_limits import Limits
from pdhocbf_drake.walking.commanded_walk import CommandedFootsteps
from pdhocbf_drake.walking.commands import Command
from pdhocbf_drake.walking.config import GaitConfig
from pdhocbf_drake.walking.frame import rotation
from pdhocbf_drake.walking.sole_gap import Pose

FIRST, STEP = 400, 40  # the tick of a push, in the settled walk
SOLE = (0.1, 0.06)
Kick = tuple[float, float]


def walk_of(**keys: object) -> Walk:
    data = {**load_scenario("walking_nobarrier").to_dict(), **keys}
    return build_walk(Scenario.from_dict(data, "pushed"))


@pytest.fixture(scope="module")
def turning() -> tuple[Walk, Memory]:
    """The template of a walk that turns, and the controller's memory when it has settled."""
    walk = walk_of(commands=[{"time": 0.0, "velocity": [0.3, 0.0], "turn": 0.4}])
    return walk, [*walk_template(walk.mpc, Memory.standing(walk.mpc), 0, FIRST)][-1].memory


def pushed(
    walk: Walk, memory: Memory, kick: Kick, after: int = 0, ticks: int = 400,
    sensor: Callable[[Measurement], Measurement] | None = None,
) -> list[TemplateTick]:  # fmt: skip
    """The ticks from FIRST on, with a kick so many ticks later [m/s]."""
    kicks = np.zeros((after + 1, 2))
    kicks[after] = kick
    return [*walk_template(walk.mpc, memory, FIRST, ticks, kicks, sensor)]


def heading(walk: Walk, row: TemplateTick) -> float:
    return row.before.problem(walk.mpc).gait.step(row.tick // STEP).yaw


def seen(walk: Walk, row: TemplateTick) -> np.ndarray:
    """c, v, p from the stance foot along its heading, (2, 3)."""
    return rotation(-heading(walk, row)) @ (row.state - row.before.stance[:, 1:] * [1.0, 0.0, 1.0])


def test_a_turning_walk_that_is_pushed_far_off_its_path_soon_walks_as_before(turning: tuple[Walk, Memory]) -> None:
    calm = [seen(turning[0], row) for row in pushed(*turning, (0.0, 0.0), ticks=2 * STEP)]
    rows = pushed(*turning, (0.4, 0.0), after=STEP)
    assert any(row.before.disturbance.active for row in rows)
    away = rows[-1].before.stance[:, 1] - pushed(*turning, (0.0, 0.0))[-1].before.stance[:, 1]
    assert np.hypot(*away) > 0.2
    for row in rows[-2 * STEP :]:
        np.testing.assert_allclose(seen(turning[0], row), calm[row.tick % (2 * STEP)], atol=5e-3)


@pytest.mark.parametrize("kick", [(0.4, 0.0), (-0.5, 0.0)])
def test_after_a_long_step_that_turns_the_foot_behind_can_pass_the_one_that_landed(
    turning: tuple[Walk, Memory], kick: Kick
) -> None:
    walk, _ = turning
    rows = pushed(*turning, kick, after=STEP // 2 + 2, ticks=STEP + 1)  # too late for the foot to keep its heading
    row, turn = rows[-1], heading(walk, rows[-1]) - heading(walk, rows[0])
    assert row.before.disturbance.active and turn == pytest.approx(0.16)
    side = walk.gait.support(row.tick // STEP)
    landed, behind = row.memory.feet[0 if side > 0 else 1], row.memory.feet[1 if side > 0 else 0]
    aside = -side * (rotation(-heading(walk, row)) @ (behind - landed))[1]
    assert aside > SOLE[1] * (1.0 + math.cos(turn)) + SOLE[0] * math.sin(turn) + 0.011


def test_a_pushed_walk_goes_on_along_the_measured_heading_of_its_foot(turning: tuple[Walk, Memory]) -> None:
    slip = 0.1

    def slipped(measurement: Measurement) -> Measurement:
        tick = measurement.tick
        if tick != FIRST + STEP:
            return measurement
        before = rows[tick - FIRST].before
        yaw = heading(turning[0], rows[tick - FIRST]) + slip
        return measurement._replace(feet=np.column_stack([before.feet, [yaw, yaw]]))

    rows = pushed(*turning, (0.0, 0.25))
    turned = pushed(*turning, (0.0, 0.25), sensor=slipped)
    later = [(a, b) for a, b in zip(rows, turned, strict=True) if a.tick > FIRST + STEP]
    for one, other in later:
        assert heading(turning[0], other) == pytest.approx(heading(turning[0], one) + slip, abs=1e-9)


def test_a_pushed_walk_keeps_its_heading_until_it_has_recovered(turning: tuple[Walk, Memory]) -> None:
    rows = pushed(*turning, (0.0, 0.25))
    yaws = np.array([heading(turning[0], row) for row in rows])
    active = np.array([row.before.disturbance.active for row in rows])
    assert active.any() and np.ptp(yaws[: np.flatnonzero(active)[-1] + 1]) == 0.0
    assert np.diff(yaws)[-1 - STEP :].max() == pytest.approx(0.16)


def test_a_walk_along_waypoints_goes_back_to_them() -> None:
    walk = walk_of(path=[[3.0, 0.0]], path_speed=0.3, duration=12.0)
    memory = [*walk_template(walk.mpc, Memory.standing(walk.mpc), 0, FIRST)][-1].memory
    rows = pushed(walk, memory, (0.0, 0.25), ticks=600)
    aside = np.array([row.before.stance[1, 1] for row in rows])
    assert np.abs(aside).max() > 0.15
    assert abs(aside[-4 * STEP :: 2 * STEP].mean() + aside[-3 * STEP :: 2 * STEP].mean()) < 0.02


@pytest.mark.parametrize("seed", range(5))
def test_a_path_that_begins_anew_moves_all_that_is_to_come_with_it(seed: int) -> None:
    random = np.random.default_rng(seed)
    command = Command(*random.uniform([-0.3, -0.1, -0.5], [0.3, 0.1, 0.5]).tolist())
    config, step = GaitConfig(), 8
    walk = CommandedFootsteps.of(config, lambda time: command, Pose(0.0, 0.0, 0.0), Limits(sole=SOLE))
    here, (x, y, yaw) = walk[step], random.uniform(-3.0, 3.0, 3).tolist()
    moved = walk.following(walk.replanned(step, (x, y), yaw))
    turn = rotation(yaw - here.yaw)
    for coming in range(step - 1, step + 5):
        expected = [x, y] + turn @ [walk[coming].x - here.x, walk[coming].y - here.y]
        np.testing.assert_allclose([moved[coming].x, moved[coming].y], expected, atol=1e-9)
        assert math.remainder(moved[coming].yaw - walk[coming].yaw - (yaw - here.yaw), math.tau) == pytest.approx(0.0)
