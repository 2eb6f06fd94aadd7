"""Commands from an input port: they hold as those of a scenario do, and the last one holds where the port is late."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder

from pdhocbf_drake import Scenario, load_scenario, make_diagram, simulate
from pdhocbf_drake.analysis.metrics import compute_metrics
from pdhocbf_drake.analysis.summary import summary_rows
from pdhocbf_drake.mpc.loop import Measurement, walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.simulation.build import Walk, build_walk
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.walking.footsteps import Footsteps
from pdhocbf_drake.walking.sides import BOTH
from tests.walks import repacked

TICK, STEP = 0.01, 0.4
STANDS = [{"time": 0.0, "stop": True}]
SEQUENCE = [
    *STANDS,
    {"time": 0.2, "velocity": [0.375, 0.0]},
    {"time": 2.1, "velocity": [0.2, 0.1], "turn": 0.5},
    {"time": 4.5, "stop": True},
    {"time": 6.3, "velocity": [-0.2, -0.05], "turn": -0.4},
]


def scenario(commands: list[dict], system: str = "vhip_nobarrier", duration: float = 8.0) -> Scenario:
    return Scenario.from_dict({**load_scenario(system).to_dict(), "commands": commands, "duration": duration}, "port")


def at(time: float) -> np.ndarray:
    """The command of the sequence at a time, as a port has it."""
    held = [command for command in SEQUENCE if command["time"] <= time + 1e-9][-1]
    return np.array([*held.get("velocity", (0.0, 0.0)), held.get("turn", 0.0), float(held.get("stop", False))])


def walked(walk: Walk, port, ticks: int = 800) -> list:
    """The template under the port's value at each tick, None for an unconnected one."""

    def sensor(measurement: Measurement) -> Measurement:
        return measurement._replace(command=None if port is None else port(measurement.tick))

    return list(walk_template(walk.mpc, Memory.standing(walk.mpc), 0, ticks, sensor=sensor))


def states(rows: list) -> np.ndarray:
    return np.array([row.state for row in rows])


@pytest.fixture(scope="module")
def from_file() -> list:
    return walked(build_walk(scenario(SEQUENCE)), None)


@pytest.fixture(scope="module")
def standing() -> Walk:
    return build_walk(scenario(STANDS))


def test_commands_of_a_port_hold_as_those_of_a_scenario_do(from_file: list, standing: Walk) -> None:
    np.testing.assert_array_equal(states(walked(standing, lambda k: at(k * TICK))), states(from_file))


def test_an_unconnected_port_leaves_the_commands_of_the_scenario(standing: Walk) -> None:
    rows = walked(standing, None, 200)
    assert np.abs(states(rows)).max() < 1e-9


def test_a_late_port_holds_its_last_command_and_says_so(from_file: list, standing: Walk) -> None:
    late = np.random.default_rng(0).random(800) < 0.5
    late[[*range(40), 215, 455, 635]] = False  # it has each command once before that is taken up

    def port(tick: int) -> np.ndarray:
        return np.where([late[tick], False, False, late[tick]], np.nan, at(tick * TICK))

    rows = walked(standing, port)
    np.testing.assert_array_equal(states(rows), states(from_file))
    reasons = np.array([row.plan.reason for row in rows])
    assert set(reasons[late]) == {Reason.LATE_COMMAND}
    assert set(reasons[~late]) == {Reason.SOLVED}


@pytest.mark.parametrize(("phase", "stop", "taken_up"), [(35, False, 4), (36, False, 5), (39, False, 5), (39, True, 4)])
def test_in_the_last_eighth_of_a_step_only_a_stop_is_read(phase: int, stop: bool, taken_up: int) -> None:
    first = [*STANDS, {"time": 0.4, "velocity": [0.2, 0.0]}]
    then = {"stop": True} if stop else {"velocity": [0.1, 0.05], "turn": 0.3}
    before, after = np.array([0.2, 0.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0] if stop else [0.1, 0.05, 0.3, 0.0])
    rows = walked(build_walk(scenario(first)), lambda k: after if k >= 120 + phase else before, 320)
    known = walked(build_walk(scenario([*first, {"time": taken_up * STEP, **then}])), None, 320)
    np.testing.assert_array_equal(states(rows), states(known))


def test_a_stop_at_any_tick_of_a_gait_stands_after_two_more_steps_and_starts_again(standing: Walk) -> None:
    asked, stop = np.array([0.2, 0.05, 0.3, 0.0]), np.array([0.0, 0.0, 0.0, 1.0])
    before = walked(standing, lambda k: asked, 480)
    for tick in (*range(400, 480, 2), 479):

        def sensor(measurement: Measurement, tick: int = tick) -> Measurement:
            return measurement._replace(command=stop if measurement.tick < tick + 170 else asked)

        rows = list(walk_template(standing.mpc, before[tick].before, tick, 270, sensor=sensor))
        sides = {row.tick // 40: row.memory.problem(standing.mpc).gait.support(row.tick // 40) for row in rows}
        read = tick // 40 + 1  # the step that takes it up
        assert [sides[step] == BOTH for step in range(read - 1, read + 3)] == [False, False, False, True]
        assert np.abs(rows[169].state[:, 1]).max() < 0.02
        assert sides[(tick + 269) // 40] != BOTH
        assert {row.plan.reason for row in rows} == {Reason.SOLVED}


def test_before_the_first_command_of_a_port_those_of_the_scenario_hold(from_file: list) -> None:
    walk = build_walk(scenario(SEQUENCE))
    rows = walked(walk, lambda tick: np.full(4, np.nan))
    np.testing.assert_array_equal(states(rows), states(from_file))


@pytest.mark.parametrize("command", [[5.0, 0.0, 9.0, 0.0], [1e300, -1e308, 1e308, 0.0], [-3.0, 2.0, 0.0, 0.4]])
def test_commands_beyond_what_is_possible_are_granted_in_part(standing: Walk, command: list[float]) -> None:
    rows = walked(standing, lambda tick: np.array(command), 400)
    assert {row.plan.reason for row in rows} == {Reason.SOLVED}
    course = rows[-1].memory.course
    assert course.asked == (*command[:3], True)
    assert np.hypot(course.command.forward, 2.0 * course.command.lateral) * STEP <= 0.23 + 1e-9
    assert abs(course.command.turn) * STEP <= 0.4 + 1e-9
    assert all(abs(granted) <= abs(asked) for granted, asked in zip(course.command[:3], command, strict=False))


def test_a_memory_under_way_survives_its_vector(standing: Walk) -> None:
    rows = walked(standing, lambda k: at(k * TICK), 300)
    memory = repacked(standing.mpc, rows[-1].memory)
    assert memory.course == rows[-1].memory.course
    assert memory.command == rows[-1].memory.command
    following = list(walk_template(standing.mpc, memory, 300, 100))
    expected = list(walk_template(standing.mpc, rows[-1].memory, 300, 100))
    np.testing.assert_array_equal(states(following), states(expected))


def test_a_walk_that_stays_without_measurements_stands_whatever_the_port_has(standing: Walk) -> None:
    def sensor(measurement: Measurement) -> Measurement:
        lost = 300 <= measurement.tick < 330
        state = np.full((2, 3), np.nan) if lost else measurement.state
        return measurement._replace(state=state, command=np.array([0.2, 0.05, 0.4, 0.0]))

    rows = list(walk_template(standing.mpc, Memory.standing(standing.mpc), 0, 1000, sensor=sensor))
    last = rows[-1]
    assert last.memory.last_step > 0
    footsteps: Footsteps = last.memory.problem(standing.mpc).gait.footsteps
    assert footsteps[last.tick // 40].side == BOTH
    assert np.abs(last.state[:, 1]).max() < 1e-3


def test_what_a_port_is_granted_in_part_is_counted() -> None:
    commands = [{"time": 0.0, "velocity": [5.0, 0.0]}, {"time": 2.0, "turn": 0.2}, {"time": 3.0, "turn": -9.0}]
    limited = scenario(commands, duration=4.5)
    metrics = compute_metrics(limited, simulate(limited), 1.0, None)
    assert metrics.commands_limited == 2 and metrics.commands_granted is not None
    assert [(each.asked[::2], round(each.granted[0], 3)) for each in metrics.commands_granted] == [
        ((5.0, 0.0), 0.575),
        ((0.0, -9.0), 0.0),
    ]
    said = dict(summary_rows(metrics))["commands"].partition("; 2 commands granted in part ")[2]
    assert said.startswith("(at 0.") and " s 0.575 of 5 m/s ahead; at " in said
    assert said.endswith(
        "of -9 rad/s turning: soles that would meet, and 0.3 rad a step, limit turns, "
        "the longest step limits velocities)"
    )


# The wired diagram.


class Sender(Block):
    """The sequence's command at each time."""

    def __init__(self) -> None:
        super().__init__()
        self.DeclareVectorOutputPort("command", 4, weakly(self._calc), {self.time_ticket()})

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(at(context.get_time()))


def sent(system: str, duration: float, copied_at: float | None = None) -> RunLog:
    """A packaged diagram that stands by its scenario, inside a diagram that sends it commands."""
    logged = make_diagram(scenario(STANDS, system, duration))
    builder = DiagramBuilder()
    walk, sender = builder.AddSystem(logged.diagram), builder.AddSystem(Sender())
    builder.Connect(sender.get_output_port(), walk.GetInputPort("command"))
    diagram = builder.Build()
    simulator = Simulator(diagram)
    if copied_at is not None:
        simulator.AdvanceTo(copied_at)
        copy = simulator.get_context().Clone()
        simulator.AdvanceTo(duration)  # the other one goes on by itself
        simulator = Simulator(diagram, copy)
    simulator.AdvanceTo(duration)
    return logged.recorded(simulator.get_context())


@pytest.mark.parametrize("copied_at", [None, 2.25])  # orbits of a command are made then
def test_the_packaged_diagram_has_the_port_and_keeps_all_in_its_context(copied_at: float | None) -> None:
    log, own = sent("vhip", 8.0, copied_at), simulate(scenario(SEQUENCE, "vhip"))
    for name in ("lip_state", "gait_phase", "com_reference", "stance_plan", "barrier_bound", "h"):
        np.testing.assert_array_equal(log[name], own[name], err_msg=name)
    np.testing.assert_array_equal(log["path"], own["path"])
    np.testing.assert_array_equal(log["command_asked"], own["command_asked"])


def test_the_robot_walks_the_same_by_the_port() -> None:
    log, own = sent("walking_nobarrier", 3.5), simulate(scenario(SEQUENCE, "walking_nobarrier", 3.5))
    for name in ("joint_state", "turn_reference", "path"):
        np.testing.assert_array_equal(log[name], own[name], err_msg=name)
