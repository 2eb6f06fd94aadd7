"""The controller for programs of one's own: by hand and as a block it plans what the packaged diagram plans."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput

from pdhocbf_drake import InputError, WalkController, load_scenario, simulate
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
