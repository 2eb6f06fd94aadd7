"""One closed loop: the block diagram, the plain loop and the steppable controller do the same, bit for bit."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator, SimulatorStatus

from pdhocbf_drake import WalkController
from pdhocbf_drake.mpc.loop import Measurement, control, walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.memory_layout import MemoryLayout
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import make_diagram

TICKS = 700
REACHED = SimulatorStatus.ReturnReason.kReachedBoundaryTime
Kicks = dict[int, tuple[float, float]]
"""Force in x and y [N] that acts from a tick to the next one."""
KICKS: dict[str, Kicks] = {
    "nothing": {},
    "a forward kick": {260: (900.0, 0.0)},
    "kicks from all sides": {205: (-400.0, 100.0), 310: (300.0, -300.0), 377: (600.0, 200.0)},
}
TEXTS = {
    "plain": "",
    "recovery": "mpc: {recovery: {}}",
    "a stop": "gait: {walk_steps: 9}, mpc: {recovery: {}}",
    "a hard barrier": "mpc: {barrier: hard}",
}


def scenario(text: str, kicks: Kicks) -> Scenario:
    pushes = [f"{{time: {k * 0.01:g}, duration: 0.01, force: [{x}, {y}, 0]}}" for k, (x, y) in kicks.items()]
    parts = [part for part in (text, f"pushes: [{', '.join(pushes)}]", f"duration: {TICKS / 100:g}") if part]
    return load_scenario("vhip", "{" + ", ".join(parts) + "}")


def of_diagram(scene: Scenario, blind: set[int]) -> tuple[np.ndarray, np.ndarray]:
    """The plant's state at each tick, and the controller's packed memory after it."""
    logged = make_diagram(scene)
    simulator = Simulator(logged.diagram)
    simulator.Initialize()
    context = simulator.get_mutable_context()
    plant, controller = (logged.diagram.GetSubsystemByName(name) for name in ("vhip", "mpc_controller"))
    mass = plant.GetMyMutableContextFromRoot(context)
    states, memories = [], []
    for k in range(TICKS):
        # The controller is updated at kδ and the plant at (k + 1/2)δ.
        simulator.AdvanceTo((k - 0.25) * 0.01 if k else 0.0)
        state = mass.get_discrete_state_vector().CopyToVector()
        if k in blind:
            mass.SetDiscreteState(np.full(6, np.nan))
        while (
            simulator.AdvanceTo((k + 0.25) * 0.01).reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition
        ):
            pass  # the fall detector ends a run whose state is no number; here it goes on
        mass.SetDiscreteState(state)
        states.append(state.reshape(2, 3))
        memories.append(controller.GetMyContextFromRoot(context).get_discrete_state_vector().CopyToVector())
    return np.array(states), np.array(memories)


def of_plain_loop(scene: Scenario, kicks: Kicks, blind: set[int]) -> tuple[np.ndarray, np.ndarray]:
    """The same of `walk_template`."""
    mpc = build_walk(scene).mpc
    layout = MemoryLayout(mpc)
    gains = np.zeros((TICKS, 2))
    for tick, force in kicks.items():
        gains[tick + 1] = 0.01 * np.array(force) / scene.vhip.mass  # a force at tick k shows at k + 1

    def sensor(true: Measurement) -> Measurement:
        return true._replace(state=np.full((2, 3), np.nan)) if true.tick in blind else true

    rows = list(walk_template(mpc, Memory.standing(mpc), 0, TICKS, gains, sensor))
    return np.array([row.state for row in rows]), np.array([layout.pack(row.memory) for row in rows])


@pytest.mark.parametrize("kicks", KICKS.values(), ids=KICKS.keys())
@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS.keys())
def test_diagram_and_plain_loop_are_equal_bit_for_bit(text: str, kicks: Kicks) -> None:
    scene, blind = scenario(text, kicks), {431, *range(520, 545)}
    states, memories = of_diagram(scene, blind)
    same_states, same_memories = of_plain_loop(scene, kicks, blind)
    wall_time = MemoryLayout(build_walk(scene).mpc).places["solver_status"].start + 1
    memories[:, wall_time] = 0.0
    np.testing.assert_array_equal(states, same_states)
    np.testing.assert_array_equal(memories, same_memories)


def test_the_scenes_of_this_file_recover_stop_and_reject_measurements() -> None:
    kicks = KICKS["a forward kick"]
    mpc = build_walk(scenario(TEXTS["recovery"], kicks)).mpc
    _, memories = of_plain_loop(scenario(TEXTS["recovery"], kicks), kicks, {431, *range(520, 545)})
    reasons = memories[:, MemoryLayout(mpc).places["solver_status"].stop - 1]
    assert {Reason.SOLVED, Reason.RECOVERING, Reason.BAD_MEASUREMENT, Reason.STOPPING} <= set(reasons)


def test_a_controller_is_stepped_without_a_simulator() -> None:
    mpc = build_walk(scenario("", {})).mpc
    controller = WalkController(mpc)
    rows = list(walk_template(mpc, Memory.standing(mpc), 0, 300))
    for row in rows:
        plan = controller.step(row.tick, row.state)
        np.testing.assert_array_equal(plan.inputs, row.plan.inputs)
    np.testing.assert_array_equal(controller.memory.com_reference, rows[-1].memory.com_reference)


def test_a_step_changes_neither_its_memory_nor_its_measurement() -> None:
    mpc = build_walk(scenario(TEXTS["recovery"], {})).mpc
    layout, memory = MemoryLayout(mpc), Memory.standing(mpc)
    random = np.random.default_rng(1)
    for k in range(400):
        before = layout.pack(memory)
        state = memory.state + 1e-4 * random.standard_normal((2, 3))
        feet, offset = memory.feet + 1e-3, np.full((2, mpc.config.horizon), 1e-3)
        measurement = Measurement(k, state, feet, offset)
        kept = [np.copy(part) for part in (state, feet, offset)]
        following, _ = control(mpc, memory, measurement)
        np.testing.assert_array_equal(layout.pack(memory), before)
        for part, same in zip((state, feet, offset), kept, strict=True):
            np.testing.assert_array_equal(part, same)
        memory = following
