"""The controller as one block: the log, the ports and the memory of the diagram with a block for each part."""

from __future__ import annotations

import pytest
from logs import differences
from pydrake.geometry import Meshcat, Role
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context

from pdhocbf_drake import InputError, simulate
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import make_diagram
from pdhocbf_drake.simulation.wiring import Form, LoggedDiagram

COMMANDS = "commands: [{time: 0.0, velocity: [0.25, 0.04], turn: 0.4}, {time: 2.0, stop: true}]"
PUSH = "pushes: [{time: 1.9, duration: 0.1, force: [60, 50, 0]}]"
LATE = "measurement: {delay_ticks: 1, noise: {com: 0.001}}, wind: [2, 0]"
TILES = "ground: [{kind: rough, from: 0.15, to: 1.0, size: 0.1, amplitude: 0.01, known: false}]"
QUICK = "plant: {time_step: 0.005}"
WALKS = {
    "a pushed template": ("vhip", "{duration: 4.0, pushes: [{time: 2.5, duration: 0.1, force: [0, 60, 0]}]}"),
    "a template without barriers": ("vhip_nobarrier", "{duration: 1.5}"),
    "a robot that is pushed": ("walking", f"{{duration: 3.0, {QUICK}, {PUSH}}}"),
    "a robot by its sensors": ("walking_sensors", f"{{duration: 1.5, {QUICK}}}"),
    "a robot whose torques change slowly": (
        "walking",
        f"{{duration: 1.3, {QUICK}, whole_body: {{kind: auto, torque_rate: 500}}}}",
    ),
    "a robot that feels the ground by its sensors": ("walking_sensors", f"{{duration: 1.6, {QUICK}, {TILES}}}"),
    "a robot that turns, by late measurements": ("walking", f"{{duration: 3.0, {QUICK}, {COMMANDS}, {LATE}}}"),
}


@pytest.mark.parametrize("walk", WALKS)
def test_the_log_is_the_same_to_the_last_bit(walk: str) -> None:
    scenario = load_scenario(*WALKS[walk])
    fused, blocks = simulate(scenario), simulate(scenario, form="blocks")
    assert differences(fused, blocks) == []
    assert len(fused) == 1 + round(scenario.duration / scenario.tick)


@pytest.mark.parametrize("name", ["vhip", "walking"])
def test_every_port_of_the_blocks_is_one_of_the_one_block(name: str) -> None:
    scenario = load_scenario(name, f"{{{COMMANDS}}}")
    blocks, fused = (make_diagram(scenario, form=form).diagram for form in ("blocks", "fused"))
    theirs = {port for system in blocks.GetSystems() for port in _outputs(system) if port not in ("u0", "y0")}
    assert theirs == {port for system in fused.GetSystems() for port in _outputs(system) if port not in ("u0", "y0")}
    assert len(fused.GetSystems()) < len(blocks.GetSystems())
    controller = fused.GetSubsystemByName("mpc_controller")
    context = controller.GetMyContextFromRoot(fused.CreateDefaultContext())
    ports = [controller.get_input_port(i) for i in range(controller.num_input_ports())]
    assert [port.get_name() for port in ports if not port.HasValue(context)] == ["command"]


def _outputs(system) -> list[str]:
    return [system.get_output_port(i).get_name() for i in range(system.num_output_ports())]


def test_a_copied_context_goes_on_as_the_first_one_does() -> None:
    """The block's whole memory is in the context: here another walk has been simulated in between."""
    logged = make_diagram(load_scenario("walking", f"{{{QUICK}, {COMMANDS}}}"), form="fused")
    simulator = Simulator(logged.diagram)
    simulator.AdvanceTo(1.0)
    copied = simulator.get_context().Clone()
    simulator.AdvanceTo(1.4)
    Simulator(logged.diagram).AdvanceTo(0.2)
    again = Simulator(logged.diagram, copied)
    again.AdvanceTo(1.4)
    assert _states(again.get_context()) == _states(simulator.get_context())
    assert differences(*_recent(logged, simulator.get_context(), again.get_context())) == []


def _states(context: Context) -> list[bytes]:
    groups = context.get_discrete_state()
    timed = [vector.copy() for vector in map(groups.value, range(groups.num_groups()))]
    return [vector.tobytes() for vector in timed if len(vector) < 300]  # without that of the MPC, which has a wall time


def _recent(logged: LoggedDiagram, *contexts: Context) -> list:
    return [logged.recorded(context).after(1.01) for context in contexts]


def test_a_form_that_there_is_not_is_refused() -> None:
    with pytest.raises(InputError, match=r"^the form of a diagram is one of blocks, fused, given 'flat'$"):
        make_diagram(load_scenario("vhip"), form="flat")  # type: ignore[arg-type]


def test_one_block_that_nobody_watches_has_only_the_shapes_that_touch() -> None:
    def shapes(form: Form, meshcat: Meshcat | None = None) -> tuple[int, int]:
        diagram = make_diagram(load_scenario("walking_stairs"), meshcat, form=form).diagram
        inspector = diagram.GetSubsystemByName("scene_graph").model_inspector()
        return inspector.num_geometries(), inspector.NumGeometriesWithRole(Role.kProximity)

    (whole, touching), (fused, still_touching) = shapes("blocks"), shapes("fused")
    assert fused == still_touching == touching < whole <= shapes("fused", Meshcat())[0]
