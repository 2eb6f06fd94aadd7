"""The controller for programs of one's own: by hand and as a block it plans what the packaged diagram plans."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput

from pdhocbf_drake import InputError, WalkController, load_scenario, simulate
from pdhocbf_drake.barriers import BarrierFilter, record
from pdhocbf_drake.mpc.memory_layout import MemoryLayout
from pdhocbf_drake.systems.gait_reference import GaitReference
from pdhocbf_drake.systems.unbundled import unbundled
from pdhocbf_drake.systems.vhip_plant import VhipPlant

TICKS = 250


@pytest.fixture(scope="module")
def packaged():
    """The log of the packaged diagram."""
    return simulate(load_scenario("vhip", f"duration: {TICKS / 100}"))


def test_stepped_by_hand_it_walks_as_in_the_packaged_diagram(packaged) -> None:
    controller = WalkController.of(load_scenario("vhip"))
    state, states = np.zeros((2, 3)), []
    for k in range(TICKS):
        states.append(state.ravel())
        plan = controller.step(k, state.tolist())
        state = controller.mpc.vhip.step_axes(k, state, plan.inputs[:, 0])
    np.testing.assert_array_equal(states, packaged["lip_state"][:TICKS])


def test_a_block_with_lip_state_alone_walks_as_in_the_packaged_diagram(packaged) -> None:
    scenario = load_scenario("vhip")
    controller = WalkController.of(scenario)
    builder = DiagramBuilder()
    mpc = builder.AddNamedSystem("mpc", controller.system())
    clock = builder.AddNamedSystem("clock", unbundled(GaitReference(controller.mpc.gait)))
    plant = builder.AddNamedSystem("plant", VhipPlant(controller.mpc.vhip, np.zeros((2, 3)), scenario.vhip.mass))
    builder.Connect(plant.GetOutputPort("lip_state"), mpc.GetInputPort("lip_state"))
    builder.Connect(mpc.GetOutputPort("zmp_reference"), plant.GetInputPort("zmp_reference"))
    builder.Connect(clock.GetOutputPort("gait_phase"), plant.GetInputPort("gait_phase"))
    sink = LogVectorOutput(plant.GetOutputPort("lip_state"), builder, scenario.tick)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(TICKS * scenario.tick)
    states = sink.FindLog(simulator.get_context()).data().T
    np.testing.assert_array_equal(states[:TICKS], packaged["lip_state"][:TICKS])


@pytest.fixture(scope="module")
def bounded():
    """A walk under several barriers on each axis, and its controller."""
    names = ("com_x", "dcm_x", "zmp_x", "lateral_speed", "com_y", "dcm_y")
    bounds = ", ".join(f"{name}: {{quantity: {name}, bound: {{kind: orbit, margin: 0.02}}}}" for name in names)
    scenario = load_scenario("vhip", f"{{duration: 4.2, barriers: {{{bounds}}}}}")
    return scenario, simulate(scenario), WalkController.of(scenario)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_filter_keeps_several_barriers_of_a_walk_over_its_touchdowns(axis: int, bounded) -> None:
    scenario, log, controller = bounded
    first, last = 320, 410
    foot = log.element("stance_plan", ("x_now", "y_now")[axis])
    states = log["lip_state"].reshape(-1, 2, 3)[:, axis] - np.outer(foot, [1.0, 0.0, 1.0])
    wanted = log["zmp_reference"].reshape(-1, 2, 2)[:, axis, 1]
    system, barriers = controller.template(axis, np.diff(foot[[first, first + 40, first + 80]]))
    assert len(barriers) == (4, 3)[axis]
    keep = BarrierFilter(system, barriers)
    for k in range(first, last):  # the walk keeps them already
        kept = keep(k, states[k], [wanted[k + 1]])
        assert kept.status == "solved"
        assert kept.input[0] == pytest.approx(wanted[k + 1], abs=1e-9)
        np.testing.assert_allclose(system.step(k, states[k], kept.input), states[k + 1], atol=1e-3)
    for barrier in barriers:
        column = list(scenario.barriers).index(barrier.name)
        recorded = record(barrier, states[first:last], first)
        np.testing.assert_allclose(recorded.h, log["h"][first:last, column], atol=1e-12)
        assert recorded.psi_min > -1e-9


def test_a_filter_holds_a_walk_that_is_pushed_ahead(bounded) -> None:
    _, log, controller = bounded
    first = 320
    state = log["lip_state"][first, :3] - log.element("stance_plan", "x_now")[first] * np.array([1.0, 0.0, 1.0])
    system, barriers = controller.template(0)
    keep, states = BarrierFilter(system, barriers), []
    for k in range(first, first + 90):
        states.append(state)
        state = system.step(k, state, keep(k, state, [log["zmp_reference"][k + 1, 1] - 0.2]).input)
    for barrier in barriers:
        assert record(barrier, states, first).h_min > -1e-9


def test_a_template_of_one_axis_is_that_of_a_straight_walk() -> None:
    walk = WalkController.of(load_scenario("vhip"))
    with pytest.raises(InputError, match=r"an axis is 0 \(x\) or 1 \(y\), given 2"):
        walk.template(2)
    with pytest.raises(InputError, match=r"the moves of two steps must have shape \(2,\), given \(3,\)"):
        walk.template(0, [0.1, 0.1, 0.1])
    turning = WalkController.of(load_scenario("vhip", "commands: [{time: 0.0, turn: 0.2}]"))
    with pytest.raises(InputError, match="its axes turn with its feet"):
        turning.template(0)


def test_only_a_walk_has_it() -> None:
    with pytest.raises(InputError, match="only a walk has this controller; van_der_pol is the oscillator"):
        WalkController.of(load_scenario("van_der_pol"))


def test_a_block_goes_on_alike_from_the_memory_it_kept_and_from_the_state_alone() -> None:
    walk = WalkController.of(load_scenario("vhip"))
    block, wall_time = walk.system(), MemoryLayout(walk.mpc).places["solver_status"].start + 1
    context, state = block.CreateDefaultContext(), np.array(walk.memory.state)
    for tick in range(60):
        state[:, 1] += 0.02 * (tick == 30)
        fresh = walk.system()
        other = fresh.CreateDefaultContext()
        other.SetDiscreteState(context.get_discrete_state_vector().value())
        for system, at in ((block, context), (fresh, other)):
            at.SetTime(tick * walk.mpc.gait.config.tick)
            system.GetInputPort("lip_state").FixValue(at, state.ravel())
            at.SetDiscreteState(system.EvalUniquePeriodicDiscreteUpdate(at))
        found, expected = (np.array(at.get_discrete_state_vector().value()) for at in (context, other))
        found[wall_time] = expected[wall_time] = 0.0
        np.testing.assert_array_equal(found, expected)
        state = np.array(MemoryLayout(walk.mpc).unpack(expected).state)
