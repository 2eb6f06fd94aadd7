"""A walk over known ground: the robot, what is refused and chosen, bounds, and the study."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from logs import differences

from pdhocbf_drake import simulate
from pdhocbf_drake.analysis.metrics import compute_metrics
from pdhocbf_drake.analysis.robot_limits import robot_limits
from pdhocbf_drake.analysis.summary import summary_rows
from pdhocbf_drake.errors import PdhocbfError
from pdhocbf_drake.fitting.uneven_effort import uneven_effort
from pdhocbf_drake.fitting.uneven_walk import uneven_steps
from pdhocbf_drake.ground.config import Slope
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.simulation.commands import commanded_gait
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import make_diagram
from pdhocbf_drake.simulation.uneven_checks import known_ground_findings, largest_rise
from pdhocbf_drake.studies.ground.command import STUDY
from pdhocbf_drake.studies.ground.courses import course
from pdhocbf_drake.studies.ground.measures import from_edges
from pdhocbf_drake.systems.signals import JOINTS

# The robot.

OVER = (
    "{duration: 5.6, gait: {com_height: 0.55}, plant: {time_step: 0.005}, ground: ["
    "{kind: slope, at: 0.3, length: 0.5, angle_deg: 6, roll_deg: 3},"
    "{kind: stairs, at: 1.1, rise: 0.05, tread: 0.25, count: 3}]}"
)


@pytest.fixture(scope="module")
def walk():
    return simulate(load_scenario("walking_nobarrier", OVER))


def test_the_robot_walks_over_a_slope_and_up_stairs_without_a_recovery(walk) -> None:
    assert walk.ending == "finished"
    assert set(walk.element("solver_status", "reason")) == {float(Reason.SOLVED)}
    assert walk.element("com_z", "z")[-1] - walk.element("com_z", "z")[0] > 0.15


def test_how_much_of_the_ground_was_walked_is_in_metrics_and_summary(walk) -> None:
    scenario = load_scenario("walking_nobarrier", OVER)

    def ground(log) -> list[str]:
        rows = dict(summary_rows(compute_metrics(scenario, log, 1.0, robot_limits(scenario))))
        return [rows["ground.0"], rows["ground.1"]]

    assert ground(walk) == ["walked 0.50 of 0.50 m of a slope", "climbed 3 of 3 stairs of 0.05 m"]
    right, left = (walk["foot_state"][:, place] for place in (0, 6))
    first = int(np.argmax(np.maximum(right, left) > 1.1)) + 45  # a step later that foot stands on the first stair
    rest = RunLog({name: table[:first] for name, table in walk.signals.items()}, walk.time[:first])
    assert ground(rest) == ["walked 0.50 of 0.50 m of a slope", "climbed 1 of 3 stairs of 0.05 m"]


def test_the_soles_stand_where_the_ground_is_as_steep_as_the_ground_is(walk) -> None:
    scenario = load_scenario("walking_nobarrier", OVER)
    feet, gait_phase = walk["foot_state"].reshape(-1, 2, 6), walk["gait_phase"]
    mid = (gait_phase[:, 0] == 20) & (gait_phase[:, 2] != 0.0)
    for row, (_, _, support) in zip(feet[mid], gait_phase[mid], strict=True):
        x, y, z, roll, pitch, _ = row[0 if support > 0 else 1]
        normal = scenario.terrain.normal(x, y)
        assert z == pytest.approx(scenario.terrain.height(x, y), abs=1e-3)
        assert pitch == pytest.approx(math.atan2(normal[0], normal[2]), abs=3e-3)
        assert roll == pytest.approx(-math.asin(normal[1]), abs=3e-3)


def test_its_metrics_are_those_of_a_walk_over_that_ground(walk) -> None:
    scenario = load_scenario("walking_nobarrier", OVER)
    found = compute_metrics(scenario, walk, 1.0, robot_limits(scenario))
    assert found.com_rms_error is not None and found.com_rms_error[2] < 2e-3
    assert found.steps_taken == int(walk["gait_phase"][-1, 1]) - scenario.gait.start_steps
    assert found.zmp_margin_min is not None and -0.005 < found.zmp_margin_min < 0.06
    assert found.distance == pytest.approx(found.distance_commanded, abs=0.02)


def test_swinging_soles_touch_no_edge(walk) -> None:
    assert from_edges(load_scenario("walking_nobarrier", OVER), walk) > 0.0


def test_torques_and_speeds_that_check_finds_on_the_ground_are_those_of_the_walk(walk) -> None:
    scenario = load_scenario("walking_nobarrier", OVER)
    biped, gait = Biped.load(scenario.robot), commanded_gait(scenario)
    effort = uneven_effort(biped, gait, (step.number for step in uneven_steps(biped, gait)))
    bends = [i for i, name in enumerate(JOINTS) if name.endswith(("hip_pitch", "knee_pitch"))]
    torques, speeds = abs(walk["feedforward"]).max(axis=0), abs(walk["desired_state"][:, 12:]).max(axis=0)
    np.testing.assert_allclose(effort.torques[bends], torques[bends], rtol=0.2)
    np.testing.assert_allclose(effort.speeds[bends], speeds[bends], rtol=0.1)
    findings = {found.check: found for found in known_ground_findings(scenario, biped)}
    most, limit = effort.torques.max(), biped.effort_limits[effort.torques.argmax()]
    assert findings["ground torque"].said.endswith(
        f"_knee_pitch needs {most:.3g} N m on this ground, {most / limit:.2f} of its limit"
    )
    assert "rad/s on this ground" in findings["ground speed"].said


def test_level_ground_is_walked_alike_as_a_slope_of_no_angle() -> None:
    level = load_scenario("walking", "{duration: 1.6, plant: {time_step: 0.005}, biped: {feels_ground: false}}")
    slope = level.model_copy(update={"ground": (Slope(at=0.5, length=1.0),)})
    one, other = simulate(level), simulate(slope)
    assert "ground_reference" in other
    for name in ("lip_state", "com_reference", "foot_state", "stance_plan", "joint_state", "h"):
        np.testing.assert_allclose(other[name], one[name], atol=1e-5, err_msg=name)


def test_both_forms_of_the_controller_walk_alike_over_uneven_ground() -> None:
    scenario = load_scenario("walking_nobarrier", OVER).model_copy(update={"duration": 2.4})
    assert differences(simulate(scenario), simulate(scenario, form="blocks")) == []


# What can't be walked, and what is chosen.


def stairs(rise: float, tread: float = 0.25, more: str = "") -> str:
    return f"{{ground: [{{kind: stairs, at: 1.0, rise: {rise}, tread: {tread}, count: 3}}]{more}}}"


def test_step_time_and_com_height_are_those_that_the_ground_asks_for_where_a_scenario_gives_none() -> None:
    level = load_scenario("walking_nobarrier").gait
    gentle, steep = (load_scenario("walking_nobarrier", stairs(rise)) for rise in (0.03, 0.12))
    assert gentle.gait.ticks_per_step == level.ticks_per_step < steep.gait.ticks_per_step
    assert steep.mpc.horizon == 2 * steep.gait.ticks_per_step
    assert level.com_height >= gentle.gait.com_height > steep.gait.com_height
    given = load_scenario("walking_nobarrier", stairs(0.12, more=", gait: {com_height: 0.56, ticks_per_step: 40}"))
    assert (given.gait.com_height, given.gait.ticks_per_step) == (0.56, 40)


def boards(width: float, length: float = 0.6) -> str:
    return f"ground: [{{kind: boards, from: 0.6, to: 3.0, length: {length}, amplitude: 0.02, width: {width}}}]"


@pytest.mark.parametrize("length", [0.3, 0.4, 0.6])
def test_on_boards_each_foot_stands_on_its_own_ones(length: float) -> None:
    gait = commanded_gait(load_scenario("walking_nobarrier", boards(2.0, length)))
    steps = [gait.step(j) for j in range(2, len(gait.footsteps.listed))]
    places = [step.x for step in steps]
    assert all(step.window[0] <= step.x <= step.window[1] for step in steps)
    assert {step.height for step in steps if 0.8 < step.x < 2.8 and step.side > 0} != {0.0}
    assert min(np.diff(places)) > 0.0
    assert max(np.diff(places)) < 0.15 + length


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (stairs(0.25), r"^the step at x = 0\.\d+ m on ground\.0 \(stairs\) is beyond the legs' reach: a rise of up "
                       r"to 0\.0\d+ m is within reach with the CoM at 0\.58 m, as here, and of up to 0\.1\d m with it "
                       r"at 0\.5\d+ m \(given: 0\.25\)$"),
        (stairs(0.05, 0.2), r"^ground: the surface from x = 1 m on is 0\.2 m long, and soles need 0\.22 m$"),
        (stairs(0.05, more=", commands: [{time: 0, velocity: [0.3, 0]}]"),
         r"^ground\.0: stairs on the map can be walked straight ahead from x = 0 alone, without commands, path or "
         r"start; with known: false it is ground that nobody expects$"),
        (stairs(0.05, more=", gait: {stride: -0.1}"),
         r"^gait\.stride: over uneven ground a walk goes ahead, with a positive stride \(given: -0\.1\)$"),
        (boards(0.25),
         r"^the step at x = \d\.\d+ m on ground\.0 \(boards\) puts the sole over the side of its surface, which must "
         r"reach from y = 0\.02 to 0\.14 m$"),
    ],
    ids=["rise", "tread", "commands", "backwards", "narrow boards"],
)  # fmt: skip
def test_what_cannot_be_walked_is_refused_by_name(text: str, said: str) -> None:
    with pytest.raises(PdhocbfError, match=said):
        make_diagram(load_scenario("walking_nobarrier", text))


def test_the_largest_rise_is_within_reach_and_a_little_more_is_not() -> None:
    scenario = load_scenario("walking_nobarrier", stairs(0.05))
    biped = Biped.load(scenario.robot)
    most = largest_rise(scenario, biped, 0)
    for share, reached in ((0.98, True), (1.1, False)):
        piece = scenario.ground[0].model_copy(update={"rise": share * most})
        steps = uneven_steps(biped, commanded_gait(scenario.model_copy(update={"ground": (piece,)})), reserve=0.0)
        assert all(not step.missed for step in steps) == reached


def test_stairs_that_are_refused_and_those_that_are_not_are_compared_with_the_same_rises() -> None:
    gait = ", gait: {com_height: 0.56, ticks_per_step: 50}, mpc: {horizon: 100}"
    lines = []
    for rise in (0.05, 0.25):
        scenario = load_scenario("walking_nobarrier", stairs(rise, more=gait))
        *_, last = known_ground_findings(scenario, Biped.load(scenario.robot))
        lines.append(re.search(r"a rise of up to .* m with it at \S+ m", last.said)[0])
    assert lines[0] == lines[1]


# Bounds of an even rise.


def test_on_the_template_h_stays_positive_over_stairs_as_on_level_ground() -> None:
    text = "{duration: 6.0, gait: {com_height: 0.55, stride: 0.25, ticks_per_step: 40}, mpc: {horizon: 80}, ground: "
    log = simulate(load_scenario("vhip", text + "[{kind: stairs, at: 1.0, rise: 0.05, tread: 0.25, count: 6}]}"))
    assert log.ending == "finished"
    assert log["h"].min() >= 0.0
    assert log.element("stance_plan", "x_now")[-1] > 2.5


def test_a_bound_that_follows_the_orbit_encloses_that_of_the_climb() -> None:
    over = "{gait: {com_height: 0.55, ticks_per_step: 40}, mpc: {horizon: 80}, ground: "
    level, climbing = (
        build_walk(load_scenario("vhip", over + ground + "}"))
        for ground in ("[]", "[{kind: stairs, at: 1.0, rise: 0.05, tread: 0.25, count: 5}]")
    )
    assert set(climbing.mpc.of_rises) == {0.05}
    rises = [climbing.gait.rise(j) for j in range(14)]
    assert rises.count(0.05) == 4
    for j, rise in enumerate(rises):
        assert climbing.mpc.on(40 * j + 3) is (climbing.mpc.of_rises[0.05] if rise else climbing.mpc)
    assert level.mpc.on(40) is level.mpc
    bounds = [np.array(walk.barriers[0].bound.values) for walk in (level, climbing)]
    assert min(bounds[1] - bounds[0]) > 0.1


# The study.


def test_a_slice_of_the_table_holds_and_is_written(tmp_path) -> None:
    scenario = load_scenario("walking")  # a plant step of 5 ms would leave the soles 3 mm from the edges
    checks, notes = STUDY.measured(scenario, rows=["stairs up 0.05"], quick=True, out=tmp_path / "table")
    assert [check.what for check in checks if not check.holds] == []
    assert {"falls", "ticks of recovery", "swinging soles from edges", "h of forward_speed"} <= {c.what for c in checks}
    assert notes[0].startswith("stairs up 0.05: steps of 0.4 s, CoM at 0.5")
    assert (tmp_path / "table" / "ground.json").exists()


def test_courses_are_drawn_by_their_seed_and_stay_within_what_is_asked() -> None:
    one, again, other = course(1, 0, 12, 0.16), course(1, 0, 12, 0.16), course(2, 0, 12, 0.16)
    assert one == again != other
    x, y, z = np.array(one).T
    assert np.all(np.abs(z) <= 0.04)
    assert np.all(np.abs(np.diff(x) / 0.2 - 1.0) <= 0.2 + 1e-3)
    np.testing.assert_allclose(y, 0.08 * (-1.0) ** np.arange(12))
