"""The diagrams, their ports, and properties of their runs."""

import numpy as np
import pytest
from logs import differences
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import PortDataType

from pdhocbf_drake.errors import PdhocbfError
from pdhocbf_drake.mpc.terms import constraints_of
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import make_diagram, simulate
from pdhocbf_drake.systems.signals import LOGGED, size

SHORT = "{duration: 1.6, from_time: 0.8}"


@pytest.fixture(scope="module")
def walking():
    return simulate(load_scenario("walking", "{duration: 2.8}"))


def port_size(scenario: Scenario, name: str) -> int:
    barriers = len(scenario.barriers) or 4  # the oscillator has four
    return size(name, barriers, scenario.mpc.horizon, len(constraints_of(scenario.mpc)))


@pytest.mark.parametrize("name", ["walking", "vhip", "van_der_pol"])
def test_every_logged_signal_is_in_the_table_with_its_size(name: str) -> None:
    scenario = load_scenario(name)
    logged = make_diagram(scenario)
    sizes = {signal: place.stop - place.start for signal, place in logged.columns.items()}
    assert sizes == {signal: port_size(scenario, signal) for signal in sizes}
    assert set(sizes) <= {signal.name for signal in LOGGED}


@pytest.mark.parametrize("name", ["walking", "vhip"])
def test_every_signal_of_the_table_is_logged_where_its_block_is(name: str) -> None:
    scenario = load_scenario(name)
    logged = make_diagram(scenario)
    blocks = {system.get_name() for system in logged.diagram.GetSystems()}
    unused = set() if scenario.mpc.disturbance else {"input_disturbance"}
    there = {signal.name for signal in LOGGED if signal.system in blocks}
    assert {"lip_state", *there} - unused <= set(logged.columns)


@pytest.mark.parametrize("name", ["walking", "vhip", "van_der_pol"])
def test_every_vector_port_of_a_block_is_in_the_table_with_its_size(name: str) -> None:
    scenario = load_scenario(name)
    drakes_own = {"plant", "scene_graph", "joint_encoders", "torque_sensors", "signals", "log", "last_zmp"}
    for block in make_diagram(scenario).diagram.GetSystems():
        if block.get_name() in drakes_own:
            continue
        ports = [block.get_input_port(i) for i in range(block.num_input_ports())]
        ports += [block.get_output_port(i) for i in range(block.num_output_ports())]
        sizes = {port.get_name(): port.size() for port in ports if port.get_data_type() == PortDataType.kVectorValued}
        assert sizes == {port: port_size(scenario, port) for port in sizes}, block.get_name()


def test_every_block_has_a_name_and_the_drawing_shows_it() -> None:
    diagram = make_diagram(load_scenario("walking")).diagram
    names = [system.get_name() for system in diagram.GetSystems()]
    chain = {
        "gait_reference", "barrier_schedule", "mpc_controller", "foot_reference", "inverse_kinematics", "joint_targets",
        "plant", "scene_graph", "state_estimator",
    }  # fmt: skip
    assert chain <= set(names)
    assert not any(name.startswith("drake/") for name in names)
    drawing = diagram.GetGraphvizString()
    assert all(name in drawing for name in chain)


def test_no_port_of_the_chain_is_left_open() -> None:
    diagram = make_diagram(load_scenario("walking")).diagram
    context = diagram.CreateDefaultContext()
    for name in ("barrier_schedule", "mpc_controller", "foot_reference", "inverse_kinematics", "joint_targets"):
        block = diagram.GetSubsystemByName(name)
        for i in range(block.num_input_ports()):
            port = block.get_input_port(i)
            if port.get_name() == "landing_delay":  # of feet that feel the ground
                continue
            assert port.HasValue(block.GetMyContextFromRoot(context)), f"{name}.{port.get_name()}"


def test_the_template_keeps_the_barrier_the_box_and_the_plan() -> None:
    log = simulate(load_scenario("vhip", "{duration: 4.0}"))
    assert log.ending == "finished"
    assert len(log) == 401
    assert log["h"].min() >= -1e-9
    lip, box = log["lip_state"], log["zmp_box"]
    for value, low, high in ((2, 0, 1), (5, 2, 3)):
        assert np.all(lip[1:, value] >= box[1:, low] - 1e-9)
        assert np.all(lip[1:, value] <= box[1:, high] + 1e-9)
    np.testing.assert_allclose(lip[:, [0, 3]], log["com_reference"][:, [0, 3]], atol=1e-12)
    speed = log.element("lip_state", "vx")
    assert np.abs(speed[-40:] - speed[-80:-40]).max() < 1e-3


def test_the_robot_follows_its_plan(walking) -> None:
    assert walking.ending == "finished"
    assert np.all(walking["solver_status"][:, 0] == 1.0)
    assert np.all(walking["solver_status"][:, 4] == 0.0)
    error = walking["lip_state"][:, [0, 3]] - walking["com_reference"][:, [0, 3]]
    assert np.sqrt((error**2).mean(axis=0)).max() < 0.01
    assert np.abs(walking["com_z"][:, 0] - walking["com_height"][:, 0]).max() < 0.01
    assert walking.element("lip_state", "x")[-1] > 0.5


def test_positive_speed_means_forward_and_the_feet_alternate(walking) -> None:
    support = walking.element("gait_phase", "support")
    height = walking.element("foot_reference", "left_z")
    assert np.all(height[support > 0] == 0.0)
    assert height[support < 0].max() == pytest.approx(0.05, abs=1e-6)


def test_two_runs_are_the_same_bit_for_bit(walking) -> None:
    assert differences(walking, simulate(load_scenario("walking", "{duration: 2.8}"))) == []


def test_the_oscillator_stays_in_its_tube() -> None:
    log = simulate(load_scenario("van_der_pol", "{duration: 30.0}"))
    assert log.ending == "finished"
    assert log["h"].min() >= -1e-9
    assert np.all(log["solver_status"][:, 0] == 1.0)
    assert np.abs(log["oscillator_input"]).max() > 1e-3  # the filter had work to do


def test_a_push_beyond_help_ends_in_a_fall_with_a_complete_log() -> None:
    text = "{duration: 4.0, pushes: [{time: 1.5, duration: 0.1, force: [900.0, 0.0, 0.0]}]}"
    log = simulate(load_scenario("walking", text))
    assert log.ending == "fell"
    assert 1.5 < log.time[-1] < 4.0
    assert all(len(table) == len(log) and np.all(np.isfinite(table)) for table in log.signals.values())
    assert log["solver_status"][:, 5].max() > 0.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{gait: {zmp_box: [0.3, 0.1]}}", "ZMP box"),
        ("{gait: {stride: 2.0}}", "stride"),
        ("{gait: {com_height: 0.9}}", "gait.com_height: the CoM at 0.9 m"),
        ("{mpc: {horizon: 100}}", "Lemma 2"),
        ("{barriers: {forward_speed: {gamma: [0.5]}}}", "relative degree"),
        ("{barriers: {forward_speed: {side: lower}}}", "outside the safe set"),
        ("{robot: nobody}", "biped"),
    ],
)
def test_a_walk_that_is_impossible_is_refused_in_one_sentence(text: str, words: str) -> None:
    with pytest.raises(PdhocbfError) as error:
        make_diagram(load_scenario("walking", text))
    assert words in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("ticks", [6, 7, 12])
def test_the_last_tick_is_not_lost_to_rounding(ticks):
    # 6·0.1 is above 0.6 in floating point, and Drake counts that way.
    text = f"{{duration: {ticks / 10}, van_der_pol: {{tick: 0.1, ticks_per_period: 63}}}}"
    assert len(simulate(load_scenario("van_der_pol", text))) == ticks + 1


def test_a_run_continued_from_a_cloned_context_is_the_run_itself(tmp_path) -> None:
    logged = make_diagram(load_scenario("vhip"))
    simulator = Simulator(logged.diagram)
    simulator.AdvanceTo(0.5)
    continued = Simulator(logged.diagram, simulator.get_context().Clone())
    for each in (simulator, continued):
        each.AdvanceTo(1.0)
    log = logged.recorded(continued.get_context())
    assert not differences(logged.recorded(simulator.get_context()), log)
    log.save(tmp_path / "log.npz")
    assert not differences(RunLog.load(tmp_path / "log.npz"), log)
