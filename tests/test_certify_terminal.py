"""Certified sets as terminal sets of the periodic MPC, and the commands that write them."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from pdhocbf_drake.cli import main
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.terminal_set import TerminalSet, limits_of, load_terminal_sets, save_terminal_sets
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.certify.report import certificate_data, certificate_lines
from pdhocbf_drake.studies.certify.scenario_certificate import certify_scenario
from pdhocbf_drake.studies.certify.starts import Start, zmp_range
from pdhocbf_drake.studies.certify.terminal import psi_terminal_set, terminal_set, terminal_sets
from pdhocbf_drake.studies.certify.trial import try_sets, walk_from

COARSE = "gait: {tick: 0.04, ticks_per_step: 10, double_support_ticks: 1}\nmpc: {horizon: 20, freeze_ticks: 2}\n"
HARD = COARSE.replace("freeze_ticks: 2", "freeze_ticks: 2, barrier: hard")


@pytest.fixture(scope="module")
def found():
    return certify_scenario(load_scenario("vhip", COARSE), with_rows=False)


@pytest.fixture(scope="module")
def terminal(found):
    return {axis: terminal_set(c.template, c.kept) for axis, c in enumerate(found.axes)}


def test_the_trial_finds_no_tick_without_a_plan_and_no_start_outside_that_can_be_saved(found):
    trial = try_sets(found, 4, seed=1)
    assert trial.infeasible_ticks == 0
    assert trial.unsavable == trial.outside == 4
    assert trial.excess_min > 0.0


@pytest.fixture(scope="module")
def hard():
    return certify_scenario(load_scenario("vhip", HARD))


def test_a_hard_barrier_keeps_its_rows_from_the_set_that_was_made_for_them(hard):
    trial = try_sets(hard, 4, seed=1)
    assert trial.infeasible_ticks == 0
    assert trial.slack_max == 0.0
    assert trial.h_min > -1e-9
    assert trial.unsavable == trial.outside == 4


def test_under_a_hard_barrier_the_set_of_h_alone_contains_infeasible_states(hard):
    # From corners with h ≥ 0, but on the way to the bound faster than gamma allows.
    walk, certificate = hard.walk, hard.axes[0]
    terminal = {0: terminal_set(certificate.template, certificate.kept)}
    mpc = PeriodicMpc(walk.gait, walk.vhip, hard.scenario.mpc, walk.mpc.barriers, terminal)
    for phase, part in enumerate(certificate.kept.sets):
        infeasible = 0
        across = Start(phase, np.append(hard.orbit[1, phase, :2], hard.axes[1].template.held[phase]))
        for vertex in part.vertices:
            corner = Start(phase, vertex + 1e-3 * (part.centre - vertex))
            zmp = min(zmp_range(certificate.template, certificate.kept, corner))
            infeasible += walk_from(mpc, [corner, across], [zmp, hard.orbit[1, phase, 2]], 10).infeasible_ticks
        assert infeasible > 0


def test_the_hard_set_holds_on_the_orbit_one_tick_before_a_plan_ends(hard):
    rows, template = terminal_sets(hard)[0], hard.axes[0].template
    assert (rows.early, terminal_sets(hard)[1].early) == (1, 0)  # no hard barrier along y
    speeds = hard.orbit[0, :, 1]
    for phase in range(rows.period):
        com, following = hard.orbit[0, phase, 0], speeds[(phase + 1) % rows.period]
        assert rows.violation(phase, com, speeds[phase], template.held[phase], following) < 1e-9
        bound = hard.walk.barriers[0].bound(phase + 1)
        assert rows.violation(phase, com, speeds[phase], template.held[phase], bound + 1e-3) > 0.0


def test_a_hard_set_is_for_one_barrier_and_its_gamma(hard, tmp_path):
    axis, file = hard.axes[0], tmp_path / "set.npz"
    with pytest.raises(InputError, match="one hard barrier an axis, not for 2"):
        psi_terminal_set(axis.template, axis.bounds * 2)
    with pytest.raises(InputError, match='psi rows, and there is none for "forward_speed"'):
        psi_terminal_set(axis.template, [dataclasses.replace(axis.bounds[0], rows=None)])
    scenario = hard.scenario
    limits = limits_of(scenario.gait, scenario.mpc, scenario.barriers)
    save_terminal_sets(file, terminal_sets(hard), limits)
    assert load_terminal_sets(file, limits)[0].early == 1
    for change in ("barriers: {forward_speed: {gamma: [0.4, 0.5]}}", "mpc: {barrier: soft}"):
        other = load_scenario("vhip", change)
        wanted = {**limits, "hard barriers": limits_of(other.gait, other.mpc, other.barriers)["hard barriers"]}
        with pytest.raises(InputError, match="was made for hard barriers = "):
            load_terminal_sets(file, wanted)


def test_from_corners_of_the_set_there_is_a_plan_at_every_tick(found, terminal):
    # Where a terminal set that is too large, or coordinates with a wrong sign, would show first.
    walk = found.walk
    mpc = PeriodicMpc(walk.gait, walk.vhip, found.scenario.mpc, walk.mpc.barriers, terminal)
    for phase, corner in ((1, 0), (6, 3), (9, 5)):
        starts = []
        for certificate in found.axes:
            part = certificate.kept.sets[phase]
            vertex = part.vertices[corner % len(part.vertices)]
            starts.append(Start(phase, vertex + 1e-4 * (part.centre - vertex)))
        zmps = [np.mean(zmp_range(c.template, c.kept, start)) for c, start in zip(found.axes, starts, strict=True)]
        assert walk_from(mpc, starts, zmps, 60).infeasible_ticks == 0


def test_a_start_outside_soon_has_no_plan(found, terminal):
    walk = found.walk
    mpc = PeriodicMpc(walk.gait, walk.vhip, found.scenario.mpc, walk.mpc.barriers, terminal)
    starts = [Start(3, np.array([0.2, 1.5, 0.15])), Start(3, np.append(found.orbit[1, 3, :2], 0.16))]
    assert walk_from(mpc, starts, [0.0, 0.0], 40).infeasible_ticks > 0


def test_the_rows_hold_on_the_nominal_orbit_and_have_a_name(found, terminal):
    for axis, rows in terminal.items():
        for phase in range(rows.period):
            com, velocity = found.orbit[axis, phase, :2]
            assert rows.violation(phase, com, velocity, found.axes[axis].template.held[phase]) < 0.0
    walk = found.walk
    mpcs = [PeriodicMpc(walk.gait, walk.vhip, found.scenario.mpc, ([], []), sets) for sets in (None, terminal)]
    names = [{b.evaluator().get_description() for b in m.problems[0].write(3).prog.GetAllConstraints()} for m in mpcs]
    assert "terminal set" not in names[0]
    assert "stability" in names[0]
    assert "terminal set" in names[1]
    assert "stability" not in names[1]


def test_the_walk_is_nearly_the_same_with_a_terminal_set(found, terminal, tmp_path):
    scenario = found.scenario
    file = tmp_path / "set.npz"
    save_terminal_sets(file, terminal, limits_of(scenario.gait, scenario.mpc, scenario.barriers))
    text = COARSE.replace("freeze_ticks: 2", f"freeze_ticks: 2, terminal_set: {file}")
    mpc = build_walk(load_scenario("vhip", text)).mpc
    starts = [Start(0, found.orbit[axis, 0, :2]) for axis in (0, 1)]
    walked = walk_from(mpc, starts, found.orbit[:, 0, 2].tolist(), 80)
    assert walked.infeasible_ticks == 0
    assert walked.h_min > 0.0


def test_a_set_survives_its_file_and_refuses_another_walk(found, terminal, tmp_path):
    scenario, file = found.scenario, tmp_path / "set.npz"
    limits = limits_of(scenario.gait, scenario.mpc, scenario.barriers)
    save_terminal_sets(file, terminal, limits)
    loaded = load_terminal_sets(file, limits)
    assert set(loaded) == {0, 1}
    for axis, rows in terminal.items():
        assert all(np.array_equal(a, b) for a, b in zip(rows.rows, loaded[axis].rows, strict=True))
        assert all(np.array_equal(a, b) for a, b in zip(rows.bounds, loaded[axis].bounds, strict=True))
    with pytest.raises(InputError, match=r"was made for stride = 0\.15, but the scenario has 0\.1; certify the"):
        load_terminal_sets(file, {**limits, "stride": 0.1})
    for change, message in (
        (f"gait: {{start_steps: {scenario.gait.start_steps + 1}}}", "was made for odd start_steps = "),
        ("mpc: {step_reach: [0.3, 0.3]}", "was made for step_reach = None"),
    ):
        other = load_scenario("vhip", change)
        start, reach = scenario.gait.model_copy(update={"start_steps": other.gait.start_steps}), other.mpc.step_reach
        mpc = scenario.mpc.model_copy(update={"step_reach": reach})
        with pytest.raises(InputError, match=message):
            load_terminal_sets(file, limits_of(start, mpc, scenario.barriers))
    with pytest.raises(InputError, match="does not exist; `pdhocbf certify` writes one"):
        load_terminal_sets(tmp_path / "none.npz", limits)
    file.write_text("nonsense")
    with pytest.raises(InputError, match="is not a terminal set"):
        load_terminal_sets(file, limits)


def test_a_guess_of_dependent_rows_changes_no_answer(found):
    # Three rows in (c, v) can't all be active; the solver must notice by itself.
    mpc = found.walk.mpc
    dependent = np.array([[1.0, 0.0, 0.0, 0.0], [1.0, 1e-9, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]])
    rows = TerminalSet(0, (dependent,) * 10, (np.ones(3),) * 10)
    mpc = PeriodicMpc(mpc.gait, mpc.vhip, mpc.config, ([], []), {0: rows})
    state = np.array([found.orbit[axis, 3] for axis in (0, 1)])
    stance = np.array([[-0.15, 0.0], [0.16, 0.0]])
    cold = mpc.solve(43, state, stance, {})
    guess = cold._replace(tick=42, active=tuple(np.ones(count) for count in mpc.rows))
    warm = mpc.solve(43, state, stance, {}, None, guess)
    assert np.all(np.isfinite(warm.inputs))
    assert warm.inputs == pytest.approx(cold.inputs, abs=1e-6)


def test_the_report_has_its_documented_keys(found):
    data = certificate_data(found, 1.0)
    assert {"enforceable", "first_failing_phase", "phases", "sweeps", "seconds"} <= set(data)
    assert data["enforceable"] is True
    assert data["first_failing_phase"] is None
    assert data["axis"] == "x"
    assert [phase["phase"] for phase in data["phases"]] == list(range(10))
    for phase, free in zip(data["phases"], data["without_barriers"]["phases"], strict=True):
        assert {"phase", "area", "vertices", "push_max", "push_min"} <= set(phase)
        corners = np.array(phase["vertices"])
        around = np.roll(corners, -1, axis=0)
        shoelace = 0.5 * np.sum(corners[:, 0] * around[:, 1] - corners[:, 1] * around[:, 0])
        assert shoelace == pytest.approx(phase["area"])
        assert phase["area"] < free["area"]
        assert phase["push_min"] < 0.0 < phase["push_max"] < free["push_max"]
    json.dumps(data, allow_nan=False)
    assert any("enforceable" in value for _, value in certificate_lines(data))


def test_certify_writes_a_folder_that_a_scenario_can_use(elsewhere, capsys):
    assert main(["certify", "vhip", "--text", COARSE, "--no-rows", "--out", "c"]) == 0
    assert "enforceable" in capsys.readouterr().out
    names = {entry.name for entry in (elsewhere / "c").iterdir()}
    assert names == {"certify.json", "terminal_set.npz", "scenario.yaml", "figures"}
    assert {figure.name for figure in (elsewhere / "c/figures").iterdir()} == {
        "safe_tube.png", "sections.png", "pushes.png"
    }  # fmt: skip
    text = COARSE.replace("freeze_ticks: 2", "freeze_ticks: 2, terminal_set: c/terminal_set.npz")
    assert set(build_walk(load_scenario("vhip", text)).mpc.terminal) == {0, 1}


def test_a_bound_that_can_not_be_kept_is_a_result_and_no_error(elsewhere, capsys):
    bound = "barriers: {forward_speed: {bound: {kind: constant, value: 0.3}}}"
    text = COARSE.replace("freeze_ticks: 2", "freeze_ticks: 2, step_tolerance: [0.0, 0.0]") + bound
    assert main(["certify", "vhip", "--text", text, "--no-rows", "--out", "c"]) == 0
    data = json.loads((elsewhere / "c/certify.json").read_text())
    assert data["enforceable"] is False
    assert data["first_failing_phase"] in range(10)
    assert f"no state is left at phase {data['first_failing_phase']}" in capsys.readouterr().out
    assert not (elsewhere / "c/terminal_set.npz").exists()
    assert all(phase["area"] == 0.0 and phase["push_max"] is None for phase in data["phases"])


def test_certify_accepts_a_user_system(elsewhere, capsys):
    (elsewhere / "cart.yaml").write_text(
        "A: [[1.0, 0.1], [0.0, 1.0]]\nB: [[0.005], [0.1]]\n"
        "states: {lower: [-1.0, -9.0], upper: [1.0, 9.0]}\n"
        "inputs: [{lower: [-1.0], upper: [1.0]}, {lower: [-0.5], upper: [0.5]}]\n"
    )
    assert main(["certify", "cart.yaml", "--out", "c"]) == 0
    data = json.loads((elsewhere / "c/certify.json").read_text())
    assert data["enforceable"]
    assert len(data["phases"]) == 2
    assert data["phases"][0]["area"] > 1.0
    assert "enforceable" in capsys.readouterr().out


CART, PULL = "A: [[1.0]]\nB: [[1.0]]\n", "inputs: {lower: [-1.0], upper: [1.0]}\n"


@pytest.mark.parametrize(
    ("system", "message"),
    [
        (f"{CART}states: {{lower: [-1.0]}}\n{PULL}", "lower and upper are"),
        (f"{CART}states: {{lower: [-1.0, 0.0], upper: [1.0, 1.0]}}\n{PULL}", "every limit must have 1 entries"),
        (f"{CART}states: {{rows: [[1.0]], bounds: [1.0]}}\n{PULL}", "bounded"),
        (f"{CART}states: {{lower: [1.0], upper: [-1.0]}}\n{PULL}", "the limits leave nothing"),
        ("A: [[1.0]]\nB: [[1.0, 2.0], [3.0]]\nstates: {lower: [-1.0], upper: [1.0]}\n" + PULL, "cart"),
        ("A: [[1.0]]\nB: [[1.0]]\nspeed: 3", "unknown key"),
    ],
)  # fmt: skip
def test_a_wrong_system_is_refused_in_one_sentence(elsewhere, capsys, system, message):
    (elsewhere / "cart.yaml").write_text(system)
    assert main(["certify", "cart.yaml"]) == 1
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error
    assert "unexpected" not in error


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["certify", "van_der_pol"], "'van_der_pol' is no walk"),
        (["certify", "nobody"], "unknown scenario 'nobody'"),
        (["certify", "vhip", "--reach", "-1"], "reach must be a length above 0"),
        (["certify", "vhip", "--reach", "0.01"], "does not cover a step"),
        (["certify", "vhip", "--starts", "-1"], "starts must be 0 or more"),
    ],
)
def test_wrong_requests_are_refused_in_one_sentence(elsewhere, capsys, arguments, message):
    assert main(arguments) == 1
    error = capsys.readouterr().err
    assert message in error
    assert len(error.strip().splitlines()[-1]) < 250
    assert "Traceback" not in error
