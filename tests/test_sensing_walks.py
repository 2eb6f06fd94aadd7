"""Late and noisy measurements and a disturbance in whole walks: turning, in any heading, from a copied context."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import make_diagram, simulate
from pdhocbf_drake.walking.frame import rotation

WIND = np.array([7.0, -4.0])


def turning(yaw: float, keys: str = "delay: auto") -> RunLog:
    """A template that turns against a wind that turns with its start."""
    x, y = (rotation(yaw) @ WIND).tolist()
    text = f"""
        duration: 4.0
        start: {{yaw: {yaw}}}
        commands: [{{time: 0, velocity: [0.3, 0.0], turn: 0.4}}]
        wind: [{x}, {y}]
        measurement: {{delay_ticks: 3}}
        mpc: {{disturbance: {{}}, {keys}}}
    """
    return simulate(load_scenario("vhip_nobarrier", text))


def test_a_turning_walk_is_the_same_in_every_heading() -> None:
    filtered = "filter: {com: 0.002, velocity: 0.02}"
    ahead, turned = turning(0.0, filtered), turning(1.1, filtered)
    for name, columns in (("lip_state", [0, 3]), ("input_disturbance", [0, 1]), ("input_disturbance", [2, 3])):
        seen = turned[name][:, columns] @ rotation(1.1)
        np.testing.assert_allclose(seen, ahead[name][:, columns], atol=1e-8)
    np.testing.assert_allclose(ahead["input_disturbance"][-1, :2], WIND / 30.0, atol=0.02)


def test_a_turn_in_wind_with_late_measurements_keeps_its_speed() -> None:
    log = turning(0.3)
    speed = np.hypot(*log["lip_state"][-160:, [1, 4]].mean(axis=0)) / np.sinc(0.4 * 1.6 / 2.0 / np.pi)
    assert speed == pytest.approx(0.3, rel=0.03)
    assert log.element("solver_status", "fallbacks").max() == 0


def test_a_copied_context_goes_on_bit_for_bit() -> None:
    text = """
        duration: 2.4
        wind: [6.0, 3.0]
        measurement: {delay_ticks: 2, noise: {com: 0.001, velocity: 0.01}}
        mpc: {disturbance: {}, zmp_lag: 60}
    """
    logged = make_diagram(load_scenario("vhip_nobarrier", text))
    simulator = Simulator(logged.diagram)
    for adjust in logged.adjust:
        adjust(simulator.get_mutable_context())
    simulator.AdvanceTo(1.805)
    copied = simulator.get_context().Clone()
    simulator.AdvanceTo(2.4)
    again = Simulator(logged.diagram, copied)
    again.AdvanceTo(2.4)
    one, other = logged.recorded(simulator.get_context()), logged.recorded(again.get_context())
    assert one["input_disturbance"][-1, 2] != 0.0
    for name in ("lip_state", "zmp_reference", "com_reference", "input_disturbance", "measured_state"):
        assert np.array_equal(one[name], other[name])
