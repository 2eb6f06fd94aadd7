"""Values that are valid each by itself, but contradict each other, are refused before anything is built."""

from __future__ import annotations

import pytest

from pdhocbf_drake.cli import main
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.build import build_walk, nominal_walk_of
from pdhocbf_drake.simulation.checks import check_scenario, unused_settings
from pdhocbf_drake.simulation.scenario_file import load_scenario, scenario_names

COARSE = "gait: {tick: 0.04, ticks_per_step: 10, double_support_ticks: 1, STRIDE}, mpc: {horizon: 20, freeze_ticks: 2}"


@pytest.mark.parametrize("name", scenario_names())
def test_packaged_scenarios_pass_and_set_nothing_unused(name):
    scenario = load_scenario(name)
    check_scenario(scenario)
    assert unused_settings(scenario) == []


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("vhip", "duration: 0.005", "duration: must be at least a tick of 0.01 s (given: 0.005)"),
        ("van_der_pol", "duration: 1e-9", "duration: must be at least a tick of 0.01 s (given: 1e-09)"),
        ("vhip", "mpc: {horizon: 8000}", "mpc.horizon: too much memory is needed for it; allowed is 960"),
        ("vhip", "gait: {ticks_per_step: 10000}", "gait.ticks_per_step: a step may last 10 s at most"),
        ("vhip", "gait: {com_height: 0.0001}", "gait.com_height: too low for a horizon of 0.8 s"),
        ("vhip", "mpc: {zmp_margin: 0.06}", "mpc.zmp_margin: must be below half of gait.zmp_box, 0.05 m (given: 0.06)"),
        ("walking", "mpc: {recovery: {zmp_box: [0.2, 0.02]}}", "must be below half of mpc.recovery.zmp_box, 0.01 m"),
        ("vhip", "gait: {stance_width: 0.05}", "gait.stance_width: must be at least mpc.stance_width_min, 0.12 m"),
        ("vhip", "gait: {stride: -3.0}", "gait.stride: must be at most 1.16 m, twice gait.com_height"),
        ("vhip", "mpc: {step_reach: [0.1, 0.5]}", "gait.stride: must be within mpc.step_reach, 0.1 m (given: 0.15)"),
        ("vhip", "pushes: [{step: 1, phase: 500, force: [1, 0, 0]}]", "must be below the 80 ticks of a gait"),
        ("vhip", "pushes: [{time: 1, phase: 5, force: [1, 0, 0]}]", "pushes.0.phase: belongs to a push at a step"),
        ("walking", "plant: {time_step: 0}", "must divide gait.tick, 0.01 s, into whole parts (given: 0.0)"),
        ("walking", "plant: {time_step: 0.007}", "plant.time_step: must divide gait.tick, 0.01 s, into whole parts"),
        ("walking", "plant: {time_step: 1e-9}", "plant.time_step: must be at least 1e-05 s, a thousandth of gait.tick"),
        ("walking", "plant: {time_step: 1.0}", "plant.time_step: must divide gait.tick, 0.01 s, into whole parts"),
    ],
)  # fmt: skip
def test_contradictions_name_key_limit_and_value(name, text, says):
    with pytest.raises(InputError) as error:
        check_scenario(load_scenario(name, text))
    assert says in str(error.value)
    assert "\n" not in str(error.value)


def test_the_robots_own_time_steps_pass():
    for step in (0.01, 0.005, 0.001, 0.0005):
        check_scenario(load_scenario("walking", f"plant: {{time_step: {step}}}"))


@pytest.mark.parametrize(
    ("name", "text", "unused"),
    [
        ("vhip", "{friction: 0.5, plant: {time_step: 0}, robot: x.yaml}", "robot, friction, plant"),
        ("vhip", "{gait: {swing_height: 0.1}}", "gait.swing_height"),
        ("vhip", "{pushes: [{time: 1, body: nose, force: [1, 0, 0]}]}", "pushes.body"),
        ("vhip", "{pushes: [{time: 1, force: [1, 0, 0]}], measurement: {delay_ticks: 1}}", ""),
        ("walking", "{system: vhip}", ""),
        ("walking", "{vhip: {mass: 20}}", "vhip"),
        ("van_der_pol", "{gait: {stride: 0.1}}", "gait"),
    ],
)  # fmt: skip
def test_unused_settings_are_found(name, text, unused):
    assert unused_settings(load_scenario(name, text)) == [key for key in unused.split(", ") if key]


def test_unused_settings_are_printed(elsewhere, capsys):
    assert main(["run", "van_der_pol", "--no-replay", "--text", "{duration: 0.05, friction: 0.5}"]) == 0
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "pdhocbf: system van_der_pol makes no use of what is set for friction"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("bound: {kind: tabulated, values: [1, 2, 3]}", 'barrier "forward_speed": the tabulated bound has 3 values'),
        ("bound: {kind: constant, value: 1.0e+308}", 'barrier "forward_speed": a bound may be 1000 m/s at most'),
        ("bound: {stride: 1.0e+6}", 'barrier "forward_speed": gait.stride: must be from -10 to 10 m (given: 1'),
        ("bound: {kind: constant, value: -0.1}", "for a backward walk use side: lower"),
        ("{side: lower, bound: {kind: constant, value: 0.1}}", "at rest, which a lower bound above 0 leaves out"),
    ],
)
def test_errors_of_bounds_name_their_barrier(text, says):
    text = text if text.startswith("{") else f"{{{text}}}"
    with pytest.raises(InputError) as error:
        build_walk(load_scenario("vhip", f"barriers: {{forward_speed: {text}}}"))
    assert says in str(error.value)


def coarse(stride: str = "stride: 0.1", more: str = ""):
    return load_scenario("vhip", f"{{{COARSE.replace('STRIDE', stride)}{more}}}")


def test_a_backward_walk_has_a_lower_bound_which_the_error_for_an_upper_one_names():
    with pytest.raises(InputError, match=r"upper bound below 0 leaves out: for a backward walk use side: lower"):
        build_walk(coarse("stride: -0.1"))
    assert build_walk(coarse("stride: -0.1", ", barriers: {forward_speed: {side: lower}}")).barriers


def test_a_long_stand_before_the_walk_costs_no_time_and_changes_no_orbit():
    short, long = (nominal_walk_of(coarse(f"start_steps: {steps}"), 0.1) for steps in (2, 900))
    assert (short == long).all()


def test_a_walk_that_settles_slowly_has_an_orbit():
    text = "{mpc: {foothold_weight: 1000, zmp_centre_weight: 30}}"
    build_walk(load_scenario("vhip", text))  # its velocity changes by 4e-9 m/s still after 60 gaits


def test_errors_of_nominal_walks_name_the_decisive_keys():
    with pytest.raises(InputError, match=r"can't be planned .*gait\.stride 10 m .* mpc\.step_tolerance \[0\.1"):
        nominal_walk_of(coarse(), 10.0)
    short = coarse().gait.model_copy(update={"ticks_per_step": 4, "tick": 0.01, "com_height_amplitude": 0.0})
    mpc = coarse().mpc.model_copy(update={"horizon": 8})
    with pytest.raises(InputError, match=r"does not settle .* gaits of 0\.08 s .*gait\.ticks_per_step 4"):
        nominal_walk_of(coarse().model_copy(update={"gait": short, "mpc": mpc}), 0.1)
