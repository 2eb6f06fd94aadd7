"""Scenarios are found, merged and refused as the command line promises."""

from __future__ import annotations

from pathlib import Path

import bipeds
import pytest
import yaml

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.scenario import Push, Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario, load_written, scenario_names
from pdhocbf_drake.yaml_text import merge, read_yaml, write_yaml

NAMES = [
    "paper_vhip",
    "paper_vhip_dcbf",
    "van_der_pol",
    "vhip",
    "vhip_dcbf",
    "vhip_nobarrier",
    "walking",
    "walking_dcbf",
    "walking_nobarrier",
]


def test_the_promised_scenarios_come_with_the_package():
    assert set(scenario_names()) >= set(NAMES)


@pytest.mark.parametrize("name", scenario_names())
def test_a_written_scenario_is_read_back_the_same(name, tmp_path):
    scenario = load_scenario(name)
    assert scenario.name == name
    assert scenario.description
    write_yaml(scenario.to_dict(), tmp_path / "other_name.yaml")
    assert load_scenario(str(tmp_path / "other_name.yaml")) == scenario


def test_a_written_scenario_says_every_default():
    data = load_scenario("walking").to_dict()
    assert data["plant"]["discrete_contact_approximation"] == "sap"
    assert set(data) == set(Scenario.model_fields)
    assert set(data["gait"]) == set(type(load_scenario("walking").gait).model_fields)


def test_the_three_walks_differ_in_their_barriers_only():
    for family in ("walking", "vhip"):
        variants = [load_scenario(f"{family}{suffix}").to_dict() for suffix in ("", "_dcbf", "_nobarrier")]
        kinds = [[b["bound"]["kind"] for b in v["barriers"].values()] for v in variants]
        assert kinds == [["orbit"], ["orbit_peak"], []]
        for variant in variants:
            for key in ("barriers", "name", "description"):
                variant.pop(key)
        assert variants[0] == variants[1] == variants[2]


def test_a_saturating_barrier_is_refused_because_the_mpc_is_quadratic():
    with pytest.raises(InputError) as caught:
        load_scenario("vhip", "barriers: {forward_speed: {class_k: saturating, class_k_scale: 0.1}}")
    assert str(caught.value).startswith(
        'vhip.barriers.forward_speed: class_k is "linear" in a scenario, because its MPC is a quadratic program, '
        'given "saturating"; from Python, BarrierFilter and add_nonlinear_barrier_rows take any'
    )


def test_overrides_change_only_the_keys_they_name():
    base, changed = load_scenario("walking"), load_scenario("walking", "gait: {stride: 0.05}")
    assert changed.gait.stride == 0.05
    assert changed.model_copy(update={"gait": base.gait}) == base


def test_null_removes_a_barrier():
    assert load_scenario("walking", "barriers: {forward_speed: null}").barriers == {}


def test_a_number_without_a_point_is_a_number():
    assert load_scenario("walking", "mpc: {foothold_weight: 1e3}").mpc.foothold_weight == 1000.0


def test_numbers_are_those_of_yaml_1_2_and_are_written_so(tmp_path):
    assert load_scenario("walking", "seed: 010").seed == 10
    words = {"a": "1e4", "b": "1:30", "c": "009", "d": "0o17", "e": 1e4, "f": 1e-9, "g": 10}
    write_yaml(words, tmp_path / "w.yaml")
    assert read_yaml(tmp_path / "w.yaml") == words == yaml.safe_load((tmp_path / "w.yaml").read_text())


@pytest.mark.parametrize("text", ["", "# nothing\n", "{}", "mine: {}", "mine:"])
def test_a_file_without_a_scenario_walks_nothing(text, tmp_path):
    (tmp_path / "empty.yaml").write_text(text)
    entry = ":mine" if "mine" in text else ""
    with pytest.raises(InputError, match=r"empty\.yaml(:mine)? holds no scenario: at least `extends: NAME`"):
        load_scenario(f"{tmp_path}/empty.yaml{entry}")


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="a system without an endless file")
def test_a_file_without_an_end_is_no_scenario():
    with pytest.raises(InputError, match=r"^file /dev/zero is no YAML file of settings: it has more than"):
        load_scenario("/dev/zero")


def test_the_stem_of_a_file_makes_a_name(tmp_path):
    (tmp_path / "my walk (2).yaml").write_text("extends: vhip\n")
    assert load_scenario(str(tmp_path / "my walk (2).yaml")).name == "my-walk-2-"


def test_an_unknown_base_is_an_error_that_names_the_file(tmp_path):
    (tmp_path / "mine.yaml").write_text("extends: other.yaml\n")
    with pytest.raises(InputError, match=r"mine\.yaml\.extends: file .*other\.yaml does not exist"):
        load_scenario(str(tmp_path / "mine.yaml"))
    (tmp_path / "mine.yaml").write_text("extends: other\n")
    with pytest.raises(InputError, match=r"mine\.yaml\.extends: there is no scenario 'other' in .* or FILE\.yaml:NAME"):
        load_scenario(str(tmp_path / "mine.yaml"))
    with pytest.raises(InputError, match=r"is a folder; a YAML file is needed, such as the scenario\.yaml of a run"):
        load_scenario(f"{tmp_path}/")


def test_a_scenario_extends_one_of_another_file_with_that_file_s_own_paths_and_names(tmp_path):
    (tmp_path / "robot").mkdir()
    (tmp_path / "robot" / "walking.yaml").write_text(
        "name: theirs\nextends: walking\nmpc: {terminal_set: set.npz}\ngait: {stride: 0.1}\n"
    )
    (tmp_path / "robot" / "both.yaml").write_text("a: {extends: walking.yaml, seed: 3}\nb: {extends: a, seed: 4}\n")
    (tmp_path / "mine.yaml").write_text("extends: robot/both.yaml:b\ngait: {tick: 0.02}\n")
    written = load_written(str(tmp_path / "mine.yaml"))
    mine = written.scenario
    assert (mine.name, mine.seed, mine.gait.stride, mine.gait.tick) == ("mine", 4, 0.1, 0.02)
    assert mine.mpc.terminal_set == str(tmp_path / "robot" / "set.npz")
    assert written.given["gait"] == {"stride": 0.1, "tick": 0.02}


@pytest.mark.parametrize(
    ("text", "braces"),
    [
        ("gait: {stride: 0.1}, duration: 5.0", "{gait: {stride: 0.1}, duration: 5.0}"),
        ("seed: 3, biped: {weigh: true} # slow", "{seed: 3, biped: {weigh: true}}"),
        ("pushes: [{time: 1, force: [1, 0, 0]}], seed: 3", "{pushes: [{time: 1, force: [1, 0, 0]}], seed: 3}"),
        ("duration: 3, seed: 3", "{duration: 3, seed: 3}"),
    ],
)
def test_several_settings_need_no_braces(text, braces):
    assert load_scenario("walking", text) == load_scenario("walking", braces)
    assert load_scenario("walking", text) != load_scenario("walking")


def test_one_of_several_scenarios_in_a_file(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("slow: {extends: walking, gait: {stride: 0.05}}\nslower: {extends: slow, gait: {stride: 0.02}}\n")
    slower = load_scenario(f"{path}:slower")
    assert (slower.name, slower.gait.stride, list(slower.barriers)) == ("slower", 0.02, ["forward_speed"])
    with pytest.raises(InputError, match=r"has no scenario 'fast'; it has slow, slower"):
        load_scenario(f"{path}:fast")
    with pytest.raises(InputError, match=r"holds several scenarios; choose one as .*:NAME from slow, slower"):
        load_scenario(str(path))


def test_a_robot_file_is_relative_to_the_scenario_file(tmp_path):
    bipeds.write(tmp_path / "robots", bipeds.resized(0.5))
    (tmp_path / "mine.yaml").write_text("robot: robots/robot.yaml\n")
    assert load_scenario(str(tmp_path / "mine.yaml")).robot == str(tmp_path / "robots" / "robot.yaml")


def test_a_map_of_another_kind_replaces_the_old_one():
    old = {"bound": {"kind": "orbit", "margin": 0.1}, "gamma": [0.5]}
    new = merge(old, {"bound": {"kind": "constant", "value": 1.0}})
    assert new == {"bound": {"kind": "constant", "value": 1.0}, "gamma": [0.5]}
    assert merge(old, {"bound": {"margin": 0.2}})["bound"] == {"kind": "orbit", "margin": 0.2}


# Each anchor stands for nine of the one before: 9⁹ numbers, were they written out.
_BOMB = "a0: &a0 [1, 1]\n" + "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 10))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "gaitt: {}",
            r"walking\.gaitt: unknown key; allowed here: barrier_changes, barriers, biped, commands, descr",
        ),
        ("stride: 0.1", r"unknown key; allowed here: .*; there is gait\.stride, mpc\.limits\.stride$"),
        ("gait: {faults: []}", r"unknown key; allowed here: .*; there is measurement\.faults$"),
        ("gait: {stridee: 1}", r"walking\.gait\.stridee: unknown key; allowed here: .*stride, swing_height"),
        ("barriers: {forward_speed: {bound: {marginn: 1}}}", r"bound\.marginn: unknown key; allowed here: .*margin"),
        ("pushes: [{force: [1, 2, 3], time: 1.0, fource: 2}]", r"fource: unknown key; allowed here: body, duration"),
        ("gait: {stride: abc}", r"walking\.gait\.stride: must be a number \(given: 'abc'\)"),
        ("gait: {stride: [1.0]}", r"walking\.gait\.stride: must be a number \(given: \[1\.0\]\)"),
        ("gait: {stride: .nan}", r"walking\.gait\.stride: .*finite number"),
        ("gait: {stride: .inf}", r"walking\.gait\.stride: .*finite number"),
        ("gait: {zmp_box: [0.1, 0.1, 0.1]}", r"walking\.gait\.zmp_box: must have at most 2 entries"),
        ("gait: {zmp_box: [0.1, 0.0]}", r"walking\.gait\.zmp_box\.1: must be above 0 and up to 10 m \(given: 0\.0\)"),
        ("gait: {zmp_box: 0.1}", r"walking\.gait\.zmp_box: must be a list \(given: 0\.1\)"),
        ("gait: {tick: -0.01}", r"walking\.gait\.tick: must be from 0\.0001 to 0\.1 s \(given: -0\.01\)"),
        ("gait: {ticks_per_step: 40.5}", r"walking\.gait\.ticks_per_step: must be a whole number"),
        ("gait: 2020-01-01", r"walking\.gait: must be a map of keys and values \(given: '2020-01-01'\)"),
        ("duration: true", r"walking\.duration: .*number"),
        ("duration: 0", r"walking\.duration: must be above 0 and up to 36000 s \(given: 0\)"),
        ("system: quadruped", r"walking\.system: .*'biped', 'vhip' or 'van_der_pol' \(given: 'quadruped'\)"),
        ("barriers: {forward_speed: {gamma: [1.5, 0.5]}}", r"gamma"),
        ("barriers: {forward_speed: {gamma: [0.0, 0.5]}}", r"gamma"),
        ("plant: {time_stepp: 0.001}", r"unknown key 'time_stepp'; Drake's MultibodyPlantConfig has: .*time_step"),
        ("plant: {time_step: -0.001}", r"time_step must be above 0 s, given -0.001"),
        ("plant: {stiction_tolerance: 0.0}", r"\.plant: is refused by Drake: set_stiction_tolerance\(\): condition"),
        ("plant: {sap_near_rigid_threshold: -1.0}", r"\.plant: is refused by Drake: set_sap_near_rigid_threshold\(\):"),
        ("simulator: {max_step_size: -0.1}", r"max_step_size must be above 0 s, given -0.1"),
        ("plant: {time_step: .nan}", r"time_step must be a finite number, given nan"),
        ("plant: {discrete_contact_approximation: tamsi}", "tamsi ignores the joints' PD; allowed: sap"),
        ("plant: {contact_model: glue}", r"Unknown contact_model: 'glue'"),
        ("simulator: {integration_scheme: guess}", r"Unknown integration scheme: guess"),
        ("pushes: [{force: [10, 0, 0]}]", r"either at a time \[s\] or at a step"),
        ("a: {b", r"--text is not valid YAML at line 1, column 6"),
        ("seed: 1}, {gait: {stride: 0.1}", r"--text is not valid YAML at line 1"),
        ("seed: 1, seed: 2", r"--text is not valid YAML at line 1"),
        ("gait: {stride: 0.1, stride: 0.2}", r"key 'stride' is given twice"),
        ("0.1", r"--text must hold a YAML map such as"),
        ("extends: vhip", r"--text overrides a scenario and cannot extend"),
        ("gait: &a {gait: *a}", r"--text is not valid YAML at line 1, column 7: a value holds itself"),
        ("? [a, b]\n: 1", r"at line 1, column 3: a key must be a word"),
        ("[" * 5000, r"nested too deeply"),
        ("pushes: !!set {a}", r"at line 1, column 9: !!set is no plain value"),
        ("name: !!binary aGVsbG8=", r"!!binary is no plain value"),
        ("name: a\0b", r"--text is not valid YAML: unacceptable character"),
        (_BOMB, r"more than 1000000 values"),
        ("duration: 1:30", r"walking\.duration: must be a number \(given: '1:30'\)"),
        ("name: ../evil", r"\.name: must be 1 to 100 letters"),
        ("barriers: {nope: null}", r"barriers\.nope: null removes a barrier, but there is forward_speed to remove"),
        ("gait: {start_steps: 1000000}", r"gait\.start_steps: must be at most 1000 \(given: 1000000\)"),
        ("gait: {ticks_per_step: 1000000}", r"gait\.ticks_per_step: must be at most 10000"),
        ("gait: {com_height: 1e6}", r"gait\.com_height: must be above 0 and up to 10 m"),
        ("gait: {tick: 1e-9}", r"gait\.tick: must be from 0\.0001 to 0\.1 s \(given: 1e-09\)"),
        ("gait: {stride: 1e9}", r"gait\.stride: must be from -10 to 10 m"),
        ("mpc: {horizon: 800000}", r"mpc\.horizon: must be at most 20000"),
        ("mpc: {slack_weight: [-1, 1]}", r"mpc\.slack_weight\.0: must be above 0"),
        ("mpc: {slack_weight: [0, 0]}", r"mpc\.slack_weight\.0: must be above 0"),
        ("mpc: {foothold_weight: 1e300}", r"mpc\.foothold_weight: must be above 0 and up to 1e\+12"),
        ("mpc: {path_correction: [-0.1, 0.05]}", r"mpc\.path_correction\.0: must be from 0 to 10 m"),
        ("mpc: {step_tolerance: [-0.1, 0.05]}", r"mpc\.step_tolerance\.0: must be from 0 to 10 m"),
        ("measurement: {delay_ticks: 1000000000}", r"measurement\.delay_ticks: must be at most 1000"),
        ("pushes: [{time: 1, force: [1.0e+308, 0, 0]}]", r"pushes\.0\.force\.0: must be from -1e\+06 to 1e\+06 N"),
        ("measurement: {noise: {com: 1.0e+300}}", r"measurement\.noise\.com: must be from 0 to 10 m"),
        ("seed: 100000000000000000000", r"walking\.seed: must be below 4\.29497e\+09"),
        ("van_der_pol: {initial_state: [1.0e+300, 0]}", r"van_der_pol\.initial_state\.0: must be at most 1000"),
        ("barriers: {a b: {bound: {kind: orbit}}}", r"walking\.barriers\.a b: must be 1 to 100 letters"),
        ("vhip: {mass: 1e-300}", r"vhip\.mass: must be from 0\.001 to 1e\+06 kg"),
    ],
)
def test_wrong_overrides_are_refused_in_one_sentence(text, says):
    with pytest.raises(InputError, match=says) as error:
        load_scenario("walking", text)
    assert "\n" not in str(error.value)


def test_an_unknown_scenario_lists_those_there_are():
    with pytest.raises(
        InputError, match=f"unknown scenario 'wlaking'; there are {', '.join(scenario_names())}, or give a YAML"
    ):
        load_scenario("wlaking")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"nowhere\.yaml does not exist"):
        load_scenario(str(tmp_path / "nowhere.yaml"))


def test_a_circle_of_scenarios_is_named(tmp_path):
    (tmp_path / "c.yaml").write_text("a: {extends: b}\nb: {extends: a}\n")
    with pytest.raises(InputError, match="extends itself: a -> b -> a"):
        load_scenario(f"{tmp_path}/c.yaml:a")
    (tmp_path / "d.yaml").write_text("extends: folder/../e.yaml:walking\n")
    (tmp_path / "e.yaml").write_text("walking: {extends: d.yaml}\n")
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError, match=r"extends itself: .*/d\.yaml -> .*e\.yaml:walking -> d\.yaml$"):
        load_scenario(f"{tmp_path}/d.yaml")


def test_a_push_at_a_step_starts_with_that_step():
    gait = load_scenario("walking").gait
    push = Push(step=3, phase=10, force=(1.0, 0.0, 0.0))
    assert push.start(gait) == pytest.approx(((gait.start_steps + 3) * 40 + 10) * 0.01)
    assert Push(time=1.5, force=(1.0, 0.0, 0.0)).start(gait) == 1.5


def test_packaged_scenarios_are_plain_yaml():
    # Users copy these files; nothing in them may depend on this package's reader.
    from pdhocbf_drake.simulation.scenario_layers import PACKAGED

    for name in scenario_names():
        text = (PACKAGED / f"{name}.yaml").read_text()
        assert isinstance(yaml.safe_load(text), dict)
