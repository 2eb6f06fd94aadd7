"""Disturbances: pushes on the template, another mass than the model's, measurement noise and delay."""

from __future__ import annotations

import numpy as np
import pytest
from logs import differences
from pydrake.systems.analysis import Simulator
from pydrake.systems.primitives import ConstantVectorSource, DiscreteTimeIntegrator

from pdhocbf_drake.config import parse_config
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.disturbance import add_measurement
from pdhocbf_drake.simulation.scenario import MeasurementConfig, Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import make_diagram, simulate
from pdhocbf_drake.simulation.wiring import Wiring
from pdhocbf_drake.studies.shared.endings import ending_of

TICK = 0.01
# A gait that builds fast.
QUICK = (
    "{duration: 0.6, mpc: {horizon: 20, freeze_ticks: 2}, "
    "gait: {ticks_per_step: 10, double_support_ticks: 1, stride: 0.02, com_height_amplitude: 0.002}, CHANGES}"
)


def quick(changes: str = "") -> Scenario:
    return load_scenario("vhip_nobarrier", QUICK.replace("CHANGES", changes))


def measured(config: dict, seed: int = 0, ticks: int = 400) -> tuple[np.ndarray, np.ndarray]:
    """A ramp of one unit a tick in all six elements, and its measured copy."""
    wiring = Wiring(TICK)
    rate = wiring.builder.AddSystem(ConstantVectorSource(np.full(6, 1.0 / TICK)))
    ramp = wiring.builder.AddSystem(DiscreteTimeIntegrator(6, TICK))
    wiring.builder.Connect(rate.get_output_port(), ramp.get_input_port())
    wiring.offer("lip_state", ramp.get_output_port())
    start = np.full(6, -1.0)
    add_measurement(wiring, parse_config(MeasurementConfig, config, "measurement"), seed, lip_state=start)
    wiring.offer("measured", wiring.port("lip_state", measured=True))
    wiring.log("lip_state", "measured")
    logged = wiring.build("test")
    simulator = Simulator(logged.diagram)
    for adjust in logged.adjust:
        adjust(simulator.get_mutable_context())
    simulator.AdvanceTo((ticks - 0.5) * TICK)
    log = logged.recorded(simulator.get_context())
    return log["lip_state"], log["measured"]


def test_a_delayed_measurement_is_the_state_of_that_many_ticks_ago() -> None:
    for delay in (1, 3):
        true, late = measured({"delay_ticks": delay}, ticks=20)
        np.testing.assert_allclose(late[delay:], true[:-delay], atol=1e-12)
        np.testing.assert_allclose(late[:delay], -1.0)


def test_noise_has_the_deviations_given_and_repeats_with_its_seed() -> None:
    config = {"noise": {"com": 0.01, "velocity": 0.2, "zmp": 0.0}}
    true, noisy = measured(config, seed=7, ticks=2000)
    noise = noisy - true
    np.testing.assert_allclose(noise.std(axis=0), [0.01, 0.2, 0.0] * 2, rtol=0.1, atol=1e-9)
    # Five standard errors.
    assert np.all(np.abs(noise.mean(axis=0)) <= np.array([0.01, 0.2, 1e-9] * 2) * 5 / np.sqrt(2000))
    assert abs(np.corrcoef(noise[:-1, 1], noise[1:, 1])[0, 1]) < 0.1  # anew at each tick
    np.testing.assert_array_equal(measured(config, seed=7, ticks=2000)[1], noisy)
    assert np.abs(measured(config, seed=8, ticks=2000)[1] - noisy)[:, 0].max() > 0.0


def test_a_perfect_measurement_adds_nothing() -> None:
    names = {system.get_name() for system in make_diagram(quick("seed: 5")).diagram.GetSystems()}
    assert not [name for name in names if "noise" in name or "delay" in name or "push" in name]


def test_the_controller_gets_the_noise_and_the_log_does_not() -> None:
    clean, noisy = simulate(quick("seed: 5")), simulate(quick("seed: 5, measurement: {noise: {velocity: 0.05}}"))
    again = simulate(quick("seed: 5, measurement: {noise: {velocity: 0.05}}"))
    assert differences(noisy, again) == []
    assert "com_reference" in differences(clean, noisy)
    # The logged state is the true one: it obeys v⁺ = v + δ eta (c − p), hence is smooth.
    assert np.abs(np.diff(noisy.element("lip_state", "vx"))).max() < 0.02


@pytest.mark.parametrize("mass", [30.0, 60.0])
def test_a_push_on_the_template_is_a_change_of_velocity(mass: float) -> None:
    push = "pushes: [{time: 0.2, duration: 0.01, force: [30.0, -15.0, 99.0]}]"
    base, pushed = simulate(quick()), simulate(quick(f"vhip: {{mass: {mass}}}, {push}"))
    change = pushed["lip_state"] - base["lip_state"]
    before = pushed.time <= 0.2 + 1e-9
    assert np.abs(change[before]).max() == 0.0
    first = change[np.argmin(before)]
    np.testing.assert_allclose(first[[1, 4]], [30.0 * TICK / mass, -15.0 * TICK / mass], rtol=1e-12)
    assert pushed["push"].any(axis=1).sum() == 1  # one tick


def test_a_template_that_leans_too_far_has_fallen() -> None:
    scenario = quick("pushes: [{time: 0.1, force: [900.0, 0.0, 0.0]}]")
    log = simulate(scenario)
    assert log.ending == "fell"
    assert log.time[-1] < 0.6
    assert ending_of(scenario, log, None) == "fell"


def test_a_run_is_survived_if_it_walks_on_as_commanded() -> None:
    scenario = load_scenario("vhip_nobarrier", "duration: 2.5")
    log = simulate(scenario)
    assert ending_of(scenario, log, None) == "survived"
    log["lip_state"][:, 0] *= 0.3
    assert ending_of(scenario, log, None) == "did not walk on"


def test_a_torso_may_be_heavier_than_in_the_controllers_model() -> None:
    scenario = load_scenario("walking_nobarrier", "{duration: 0.01, model_error: {torso_mass: 1.2}}")
    logged = make_diagram(scenario)
    plant = logged.diagram.GetSubsystemByName("plant")
    context = logged.diagram.CreateDefaultContext()
    modelled = plant.CalcTotalMass(plant.GetMyContextFromRoot(context))
    for adjust in logged.adjust:
        adjust(context)
    torso = plant.get_body(plant.GetFloatingBaseBodies().pop())
    true = plant.CalcTotalMass(plant.GetMyContextFromRoot(context))
    assert true - modelled == pytest.approx(0.2 * torso.default_mass(), rel=1e-9)


def test_a_push_on_a_body_that_is_not_there_names_those_there_are() -> None:
    scenario = load_scenario("walking_nobarrier", "pushes: [{time: 1.0, body: tail, force: [1.0, 0.0, 0.0]}]")
    with pytest.raises(InputError, match=r"pushes: the robot has no body 'tail'; it has .*, torso"):
        make_diagram(scenario)
