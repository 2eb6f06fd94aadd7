"""Bounds of walks that follow commands: orbits of two steps, envelopes while a command changes, stands, emergencies."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from pdhocbf_drake.mpc import commanded_orbit
from pdhocbf_drake.mpc.loop import Measurement, TemplateTick, walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.simulation.build import Walk, build_walk
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.systems.barrier_schedule import BarrierSchedule
from pdhocbf_drake.walking.commanded_bound import CommandedBound
from pdhocbf_drake.walking.commands import Command
from pdhocbf_drake.walking.course import UNSETTLED
from pdhocbf_drake.walking.frame import rotation
from pdhocbf_drake.walking.quantities import QUANTITIES
from pdhocbf_drake.walking.sides import BOTH
from pdhocbf_drake.walking.walk_barrier import WalkBarrier

N, MARGIN = 40, 0.02
TURN = ({"time": 0.0, "velocity": (0.3, 0.0), "turn": 0.5},)
SEQUENCE = (
    {"time": 0.0, "velocity": (0.375, 0.0)},
    {"time": 2.1, "velocity": (0.2, 0.1), "turn": 0.5},
    {"time": 4.5, "stop": True},
    {"time": 6.3, "velocity": (-0.2, -0.05), "turn": -0.4},
)


def walk_of(commands, barriers: dict, **keys) -> Walk:
    data = {**load_scenario("vhip_nobarrier").to_dict(), "commands": [*commands], "barriers": barriers, **keys}
    return build_walk(Scenario.from_dict(data, "bounds"))


def on(quantity: str, side: str = "upper", kind: str = "orbit", margin: float = MARGIN) -> dict:
    return {"quantity": quantity, "side": side, "bound": {"kind": kind, "margin": margin}}


def walked(walk: Walk, ticks: int, sensor=None) -> list[TemplateTick]:
    return list(walk_template(walk.mpc, Memory.standing(walk.mpc), 0, ticks, sensor=sensor))


def seen(walk: Walk, row: TemplateTick, yaw: float | None = None) -> np.ndarray:
    """s of both axes from the stance foot, along its heading or another one, shape (2, 3)."""
    own = walk.gait.step(row.tick // N).yaw if yaw is None else yaw
    return rotation(-own) @ (row.state - row.before.stance[:, 1:] * [1.0, 0.0, 1.0])


def counted(barrier: WalkBarrier, walk: Walk, row: TemplateTick, yaw: float | None = None) -> float:
    """σ n·s: σ by the foot that stands."""
    quantity = barrier.quantity
    normal = quantity.normals(walk.vhip)[row.tick % N % len(quantity.normals(walk.vhip))]
    sign = -walk.gait.support(row.tick // N) if quantity.mirrored else 1.0
    return float(sign * (normal @ seen(walk, row, yaw)[quantity.axis]))


@cache
def turning() -> tuple[Walk, list[TemplateTick]]:
    walk = walk_of(TURN, {name: on(name) for name in QUANTITIES})
    free = walk_of(TURN, {})
    return walk, walked(free, 14 * N)


@pytest.mark.parametrize("name", QUANTITIES)
def test_the_bound_of_a_settled_turn_is_its_own_orbit_of_two_steps(name: str) -> None:
    walk, rows = turning()
    barrier = next(b for b in walk.barriers if b.name == name)
    margins = [walk.mpc.bounds(row.tick)[name][0] - counted(barrier, walk, row) for row in rows[10 * N :]]
    np.testing.assert_allclose(margins, MARGIN, atol=2e-5)


@pytest.mark.parametrize("name", QUANTITIES)
@pytest.mark.parametrize("tick", [400, 425, 439])
def test_coming_steps_are_judged_along_the_present_heading_as_they_will_be_along_their_own(
    name: str, tick: int
) -> None:
    walk, rows = turning()
    barrier = next(b for b in walk.barriers if b.name == name)
    ahead, yaw = walk.mpc.bounds(tick)[name], walk.gait.step(tick // N).yaw
    for i in range(len(ahead)):
        row = rows[tick + i]
        margin = ahead[i] - counted(barrier, walk, row, yaw)
        assert margin == pytest.approx(MARGIN, abs=2e-5)


def test_inner_and_outer_steps_of_a_turn_have_bounds_of_their_own() -> None:
    walk, _ = turning()
    bound = walk.mpc.bounds(10 * N)["forward_speed"][0], walk.mpc.bounds(11 * N)["forward_speed"][0]
    assert abs(bound[0] - bound[1]) > 0.005
    for name in QUANTITIES:
        here, later = walk.mpc.bounds(10 * N)[name], walk.mpc.bounds(12 * N)[name]
        np.testing.assert_allclose(here, later, atol=1e-9)


def test_a_peak_clears_the_orbit_of_both_steps() -> None:
    barriers = {name: on("forward_speed", kind=name) for name in ("orbit", "orbit_peak")}
    walk = walk_of(TURN, barriers)
    orbit, peak = (np.array([walk.mpc.bounds(k)[name][0] for k in range(400, 480)]) for name in barriers)
    np.testing.assert_allclose(peak, orbit.max())


@pytest.mark.parametrize("side", ["upper", "lower"])
@pytest.mark.parametrize("name", ["forward_speed", "lateral_speed", "com_y", "dcm_x"])
def test_while_a_command_changes_the_bound_is_the_envelope_of_both_orbits(name: str, side: str) -> None:
    outer = max if side == "upper" else min
    one, other = (
        walk_of([{"time": 0.0, **command}], {"b": on(name, side)})
        for command in ({"velocity": (0.3, 0.0), "turn": 0.5}, {"velocity": (0.1, 0.05), "turn": -0.3})
    )
    commands = [
        {"time": 0.0, "velocity": (0.3, 0.0), "turn": 0.5},
        {"time": 4.0, "velocity": (0.1, 0.05), "turn": -0.3},
    ]
    walk = walk_of(commands, {"b": on(name, side)})
    for step in range(9, 20):
        for tick in (step * N, step * N + 17):
            before, after = one.mpc.bounds(tick)["b"][0], other.mpc.bounds(tick)["b"][0]
            expected = before if step < 10 else outer(before, after) if step < 10 + UNSETTLED else after
            # The new walk is the same walk as from the start, on the same feet.
            assert walk.gait.support(step) == other.gait.support(step) == one.gait.support(step)
            assert walk.mpc.bounds(tick)["b"][0] == pytest.approx(expected, abs=1e-5)


def test_a_stand_has_the_bound_of_rest_once_it_has_settled() -> None:
    walk = walk_of([{"time": 0.0, "velocity": (0.3, 0.0)}, {"time": 4.0, "stop": True}], {"b": on("dcm_y")})
    stands = next(step for step in range(10, 30) if walk.gait.support(step) == BOTH)
    np.testing.assert_allclose(walk.mpc.bounds((stands + UNSETTLED + 1) * N)["b"], MARGIN, atol=1e-12)


@pytest.mark.parametrize(("name", "below"), [("forward_speed", 2e-3), ("lateral_speed", 2e-2), ("dcm_x", 1e-6)])
@pytest.mark.parametrize("side", ["upper", "lower"])
def test_a_walk_under_changing_commands_keeps_the_envelope(name: str, below: float, side: str) -> None:
    walk = walk_of(SEQUENCE, {"b": on(name, side)})
    rows = walked(walk, 1000)
    (barrier,) = walk.barriers
    sign = 1.0 if side == "upper" else -1.0
    swings = [row for row in rows if walk.gait.support(row.tick // N) != BOTH]
    h = np.array([sign * (walk.mpc.bounds(row.tick)["b"][0] - counted(barrier, walk, row)) for row in swings])
    assert h.min() > -below
    assert np.mean(h < -1e-9) < 0.01


@pytest.mark.parametrize("yaw", [math.pi / 2, 2.5])
def test_a_barrier_acts_alike_at_any_heading(yaw: float) -> None:
    barriers = {"a": on("forward_speed", margin=0.0), "b": on("com_y", "lower")}
    one, other = (walked(walk_of(SEQUENCE, barriers, start={"yaw": angle}), 500) for angle in (0.0, yaw))
    assert any(row.plan.acting.any() for row in one)
    moved = rotation(yaw) @ np.array([row.state for row in one])
    np.testing.assert_allclose([row.state for row in other], moved, atol=1e-8)


def test_mirrored_commands_and_feet_give_the_mirrored_walk_under_mirrored_barriers() -> None:
    barriers = {name: on(name) for name in ("lateral_speed", "com_y", "forward_speed")}
    mirrored = [
        {**c, "velocity": (c["velocity"][0], -c["velocity"][1]), "turn": -c.get("turn", 0.0)} if "velocity" in c else c
        for c in SEQUENCE
    ]
    gait = load_scenario("vhip_nobarrier").to_dict()["gait"]
    one = walked(walk_of(SEQUENCE, barriers), 800)
    other = walked(walk_of(mirrored, barriers, gait={**gait, "first_stance": "left"}), 800)
    np.testing.assert_allclose(
        np.array([row.state for row in other]) * [[1.0], [-1.0]], [row.state for row in one], atol=1e-8
    )


@pytest.mark.parametrize("lateral", [0.08, -0.08])
def test_a_mirrored_barrier_belongs_to_the_foot_that_stands_whichever_began(lateral: float) -> None:
    """After a stop the other foot may begin than before."""
    commands = [
        {"time": 0.0, "velocity": (0.2, 0.0)},
        {"time": 2.5, "stop": True},
        {"time": 5.0, "velocity": (0.2, lateral)},
    ]
    walk = walk_of(commands, {"b": on("lateral_speed")})
    rows = walked(walk, 1240)
    (barrier,) = walk.barriers
    h = np.array([walk.mpc.bounds(row.tick)["b"][0] - counted(barrier, walk, row) for row in rows[1120:]])
    # How a walk started leaves a little in its left and right steps; the bound of the other foot is 0.2 m/s off.
    np.testing.assert_allclose(h, MARGIN, atol=5e-3)


def test_commands_of_a_port_have_the_same_bounds() -> None:
    barriers = {"a": on("forward_speed", margin=0.0), "b": on("com_y", "lower")}
    standing = ({"time": 0.0, "stop": True},)
    later = [*standing, *({**command, "time": command["time"] + 0.2} for command in SEQUENCE)]

    def port(measurement: Measurement) -> Measurement:
        now = [c for c in later if c["time"] <= measurement.tick / 100 + 1e-9][-1]
        asked = [*now.get("velocity", (0.0, 0.0)), now.get("turn", 0.0), float(now.get("stop", False))]
        return measurement._replace(command=np.array(asked))

    one, other = walked(walk_of(later, barriers), 800), walked(walk_of(standing, barriers), 800)
    assert np.abs([row.state for row in other]).max() < 1e-6
    other = walked(walk_of(standing, barriers), 800, port)
    np.testing.assert_array_equal([row.state for row in other], [row.state for row in one])


def test_no_tick_walks_more_of_the_orbit_of_a_coming_command_than_a_gait(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whenever a port's command comes in a step, its orbit is there where it is taken up."""
    walked_ticks = [0]

    def planned(*_: object) -> None:
        walked_ticks[-1] += 1

    def port(measurement: Measurement) -> Measurement:
        place = measurement.tick // (2 * N + 5)  # each comes later in its step than the one before
        asked = np.random.default_rng(place).uniform([-0.2, -0.12, -0.45], [0.375, 0.12, 0.45])
        walked_ticks.append(0)
        return measurement._replace(command=np.array([*asked, 0.0]))

    robot = load_scenario("walking").to_dict()
    walk = walk_of(({"time": 0.0, "stop": True},), {"b": on("forward_speed")}, gait=robot["gait"], mpc=robot["mpc"])
    monkeypatch.setattr(commanded_orbit, "check_planned", planned)
    rows = walked(walk, 17 * N, port)
    assert max(walked_ticks) == 2 * N
    assert len({row.memory.course.command for row in rows if row.memory.course is not None}) == 8


@pytest.mark.parametrize("command", [Command(), Command(0.3, 0.0, 0.5), Command(0.1, -0.1, -0.3), Command(-0.2, 0.05)])
def test_the_orbit_of_a_command_is_the_walk_that_settles_under_it(command: Command) -> None:
    walk = walk_of(({"time": 0.0, "velocity": command[:2], "turn": command.turn},), {"b": on("forward_speed")})
    free = walk_of(({"time": 0.0, "velocity": command[:2], "turn": command.turn},), {})
    rows = walked(free, 26 * N)[24 * N :]
    orbit = walk.barriers[0].orbits.of(command)
    found = np.concatenate([orbit[0 if walk.gait.support(step) > 0 else 1] for step in (24, 25)], axis=1)
    settled = np.stack([seen(free, row) for row in rows], axis=1)
    # A walk that does not turn keeps, across the heading, a millimetre or two that its start has left.
    axes = slice(0, 2 if command.turn else 1)
    np.testing.assert_allclose(found[axes], settled[axes], atol=1e-5)
    np.testing.assert_allclose(found, settled, atol=5e-3)


@pytest.mark.parametrize("turn", [0.2, -0.05])
def test_a_slow_turn_in_place_has_an_orbit(turn: float) -> None:
    """The difference of left and right steps that its start leaves takes hundreds of gaits to go."""
    walk = walk_of(({"time": 0.0, "turn": turn},), {"b": on("dcm_y")})
    orbit = walk.barriers[0].orbits.of(Command(turn=turn))
    assert orbit is not None
    across = orbit[0, 1, :, 0] + orbit[1, 1, :, 0]
    assert np.abs(across).max() < 0.02


# The walk that is really walked.


def schedule(walk: Walk, tick: int, last_step: float, resumed=(-1.0, 0.0, -1.0)) -> np.ndarray:
    """V̄ now of the only barrier, by the block, with what a controller has changed."""
    block = BarrierSchedule(walk.axes, walk.barriers, walk.gait, walk.mpc.config.horizon)
    context = block.CreateDefaultContext()
    step, phase = divmod(tick, N)
    values = {
        "gait_phase": [phase, step, walk.gait.support(step)],
        "lip_state": np.zeros(6),
        "last_step": [last_step],
        "resumed": resumed,
    }
    if walk.gait.turns:
        values["path"] = walk.gait.path(step)
    if any(barrier.from_stance for barrier in walk.barriers):
        values["stance_plan"] = np.zeros(8)
    for name, value in values.items():
        block.GetInputPort(name).FixValue(context, value)
    return block.get_output_port().Eval(context)[: walk.mpc.config.horizon + 1]


@pytest.mark.parametrize("commands", [(), TURN])
def test_an_emergency_stop_changes_the_bound_of_the_schedule(commands: tuple) -> None:
    walk = walk_of(commands, {"b": on("dcm_y")})
    for tick in (400, 480, 520, 800):
        stopped = walk.mpc.ending_at(11)
        np.testing.assert_array_equal(schedule(walk, tick, -1.0), walk.mpc.bounds(tick)["b"])
        np.testing.assert_array_equal(schedule(walk, tick, 11.0), stopped.bounds(tick)["b"])
    assert np.abs(schedule(walk, 520, 11.0) - schedule(walk, 520, -1.0)).max() > 0.01


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("commands", [(), ({"time": 0.0, "velocity": (0.3, 0.0)}, {"time": 4.0, "stop": True})])
def test_steps_in_place_of_a_stand_have_the_bound_of_a_foot(commands: tuple, side: float) -> None:
    gait = load_scenario("vhip_nobarrier").to_dict()["gait"]
    walk = walk_of(commands, {"b": on("com_y")}, gait={**gait, "walk_steps": None if commands else 8})
    tick = 20 * N
    resumed = (float(tick), side, 21.0)
    standing, stepping = schedule(walk, tick, -1.0)[:N], schedule(walk, tick, -1.0, resumed)[:N]
    assert np.all(np.abs(standing) < 0.03)  # from the middle between the feet
    # From a foot the CoM is most of half a stance width towards the other one.
    assert np.all(stepping > 0.05)


def test_a_stop_after_a_turn_is_that_of_a_walk_without_the_barrier_that_it_is_far_from() -> None:
    """The bound goes from orbit to orbit at each touchdown, and a stand does not: no row compares h across that."""
    robot = load_scenario("walking").to_dict()
    commands = ({"time": 0.0, "velocity": (0.1, 0.08), "turn": -0.4}, {"time": 4.0, "stop": True})
    walk, free = (
        walk_of(commands, barriers, gait=robot["gait"], mpc=robot["mpc"])
        for barriers in ({"b": on("forward_speed", margin=0.0266)}, {})
    )
    rows = walked(walk, 16 * N)
    states, without = (np.array([row.state for row in each]) for each in (rows, walked(free, 16 * N)))
    np.testing.assert_allclose(states, without, atol=2e-3)
    assert sum(bool(row.plan.acting.any()) for row in rows) < N


def test_a_command_that_has_no_orbit_has_no_bound() -> None:
    walk = walk_of(TURN, {"b": on("com_x")})
    (barrier,) = walk.barriers
    barrier.orbits = barrier.orbits._replace(of=lambda command: None)
    bound = CommandedBound(barrier, walk.gait, 81)(10 * N)
    np.testing.assert_array_equal(bound, barrier.quantity.largest)
