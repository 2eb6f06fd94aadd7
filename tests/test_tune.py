"""The search for a gait: steady motions against the walk of the robot, the search, its aims, and the command."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pdhocbf_drake.cli import main
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.fitting.steady_motion import OutOfReach, SteadyMotion, steady_motion
from pdhocbf_drake.robot import ROLES, Biped
from pdhocbf_drake.simulation.build import nominal_mpc
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.studies.shared.gait_measures import GaitMeasures, peaks_by_role, steady_walk
from pdhocbf_drake.studies.shared.gait_variants import KEYS, Work, varied
from pdhocbf_drake.studies.tune.aims import AIMS, BEYOND, cost
from pdhocbf_drake.studies.tune.chosen import chosen
from pdhocbf_drake.studies.tune.joint_limits import JointLimits
from pdhocbf_drake.studies.tune.search import Space, search
from pdhocbf_drake.studies.tune.study import tune

LIMITS = JointLimits(dict.fromkeys(ROLES, 100.0), dict.fromkeys(ROLES, 10.0))


def gait(ending: str = "finished", **changes: Any) -> GaitMeasures:
    measures: dict[str, Any] = {
        "speed": 0.4, "torque": dict.fromkeys(ROLES, 50.0), "joint_speed": dict.fromkeys(ROLES, 5.0),
        "zmp_inside": 0.01, "h_min": {"speed": 0.01}, "certified_area": 0.3,
    }  # fmt: skip
    return GaitMeasures({}, ending, **measures | changes)


def test_steady_motion_is_the_planned_motion_of_the_simulated_robot() -> None:
    scenario = load_scenario("walking_nobarrier", "{duration: 4.0, gait: {com_height: 0.57, com_height_phase: 14}}")
    motion = steady_motion(Biped.load("biped"), nominal_mpc(scenario, scenario.gait.stride, None))
    assert isinstance(motion, SteadyMotion)
    log = simulate(scenario).after(2.4)
    planned = peaks_by_role(log["feedforward"])
    for role, torque in peaks_by_role(motion.torques).items():
        assert torque == pytest.approx(planned[role], rel=0.05, abs=0.3), role
    speeds = peaks_by_role(log["desired_state"][:, 12:])
    for role, speed in peaks_by_role(motion.speeds).items():
        assert speed == pytest.approx(speeds[role], rel=0.05, abs=0.1), role
    assert motion.zmp_inside > 0.0
    assert steady_walk(scenario, log)["zmp_inside"] == pytest.approx(motion.zmp_inside, abs=0.01)


def test_a_walk_out_of_reach_is_said_so() -> None:
    scenario = load_scenario("walking_nobarrier", "gait: {com_height: 0.62, stride: 0.3}")
    motion = steady_motion(Biped.load("biped"), nominal_mpc(scenario, scenario.gait.stride, None))
    assert isinstance(motion, OutOfReach)
    assert "misses by" in motion.reason


def test_the_search_comes_to_the_least_cost_and_measures_no_gait_twice() -> None:
    best = {"com_height_phase": 6, "com_height": 0.61, "com_height_amplitude": 0.003, "double_support_ticks": 6,
            "ticks_per_step": 46}  # fmt: skip
    seen: list[str] = []

    def costs(gaits: list[dict[str, Any]]) -> list[float]:
        seen.extend(map(str, gaits))
        return [sum(((g[key] - value) / value) ** 2 for key, value in best.items()) for g in gaits]

    found = search(Space(load_scenario("walking"), KEYS), costs)
    assert len(seen) == len(set(seen)) == len(found) < 200
    least, values = found[0]
    assert least < 0.2 * found[-1][0]
    assert [math.isclose(values[key], value, rel_tol=0.2) for key, value in best.items()].count(False) <= 1
    assert all(isinstance(values[key], int) for key in KEYS if "ticks" in key or "phase" in key)


def test_the_own_gait_is_where_the_search_begins() -> None:
    scenario = load_scenario("walking")
    space = Space(scenario, (*KEYS, "stride"))
    own = space.values(space.start)
    assert own.pop("com_height_phase") == 20  # the middle
    assert own == {key: getattr(scenario.gait, key) for key in own}


def test_less_of_what_is_aimed_at_costs_more() -> None:
    worse = {
        "torque": gait(torque=dict.fromkeys(ROLES, 51.0)), "zmp": gait(zmp_inside=0.009),
        "speed": gait(speed=0.39), "push": gait(certified_area=0.29),
    }  # fmt: skip
    assert set(worse) == set(AIMS)
    for aim, other in worse.items():
        assert cost(gait(), aim, None, LIMITS, 0.0) < cost(other, aim, None, LIMITS, 0.0) < math.inf
    knee = dict.fromkeys(ROLES, 50.0) | {"knee_pitch": 40.0}
    assert cost(gait(torque=knee), "torque", "knee_pitch", LIMITS, 0.0) == 40.0


@pytest.mark.parametrize(
    "bad",
    [
        gait("fell"), gait(zmp_inside=-0.001), gait(h_min={"speed": -1e-3}),
    ],
)  # fmt: skip
def test_what_asks_too_much_is_never_chosen(bad: GaitMeasures) -> None:
    for aim in AIMS:
        assert math.isinf(cost(bad, aim, None, LIMITS, 0.0))


@pytest.mark.parametrize(
    ("bad", "worse"),
    [
        (gait(torque=dict.fromkeys(ROLES, 91.0)), gait(torque=dict.fromkeys(ROLES, 92.0))),
        (gait(joint_speed=dict.fromkeys(ROLES, 9.1)), gait(joint_speed=dict.fromkeys(ROLES, 9.2))),
    ],
)
def test_joints_come_to_have_torque_and_speed_to_spare_before_anything_is_aimed_at(
    bad: GaitMeasures, worse: GaitMeasures
) -> None:
    poor = gait(zmp_inside=0.0, speed=0.01, certified_area=0.0, torque=dict.fromkeys(ROLES, 89.0))
    for aim in AIMS:
        costs = [cost(tried, aim, None, LIMITS, 0.0) for tried in (poor, bad, worse)]
        assert costs == sorted(costs)
        assert costs[0] < BEYOND < costs[1] < costs[2] < math.inf


def test_what_is_asked_of_a_joint_is_said_with_its_name() -> None:
    assert LIMITS.asked_most(gait(torque=dict.fromkeys(ROLES, 50.0) | {"hip_roll": 97.0})) == (
        "hip_roll uses 97 % of its torque"
    )
    fast = gait(torque=dict.fromkeys(ROLES, 50.0), joint_speed=dict.fromkeys(ROLES, 1.0) | {"knee_pitch": 9.5})
    assert LIMITS.asked_most(fast) == "knee_pitch uses 95 % of its speed"


def test_gaits_that_ask_too_much_of_a_joint_are_simulated_only_if_there_are_no_others() -> None:
    good, bad = gait()._replace(values={"n": 0}), gait()._replace(values={"n": 1})
    assert chosen({1.0: good, BEYOND + 1.0: bad}, gait(), 2) == [good]
    assert chosen({BEYOND + 1.0: bad}, gait(), 2) == [bad]


def test_every_second_gait_that_is_simulated_keeps_its_zmp_as_far_inside() -> None:
    own = gait(zmp_inside=0.01)
    tried = [gait(zmp_inside=inside)._replace(values={"n": n}) for n, inside in enumerate([0.002, 0.003, 0.012, 0.02])]
    costs = {0.1 * (n + 1): other for n, other in enumerate(tried)} | {math.inf: gait(zmp_inside=0.5)}
    for count, numbers in ((1, [0]), (2, [0, 2]), (3, [0, 2, 1]), (9, [0, 2, 1, 3])):
        assert [found.values["n"] for found in chosen(costs, own, count)] == numbers
    assert [found.values["n"] for found in chosen(costs, gait(zmp_inside=None), 2)] == [0, 1]


def test_a_gait_that_is_granted_less_than_commanded_is_none_for_the_aim() -> None:
    assert cost(gait(), "torque", None, LIMITS, 0.0, 0.4) < math.inf
    assert math.isinf(cost(gait(speed=0.3), "torque", None, LIMITS, 0.0, 0.4))
    assert cost(gait(speed=0.3), "speed", None, LIMITS, 0.0, 0.4) < math.inf


def test_a_higher_com_spares_the_knee_and_the_file_walks_like_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = tmp_path / "spared.yaml"
    words = ["--joint", "knee_pitch", "--keys", "com_height", "--confirm", "1", "--workers", "1", "--out", str(place)]
    assert main(["tune", "walking", *words]) == 0
    table = capsys.readouterr().out
    assert "com_height 0.58" in table
    assert place.read_text().splitlines()[2:4] == ["extends: walking", "gait:"]
    written, packaged = load_scenario(str(place)), load_scenario("walking")
    assert written.barriers == packaged.barriers
    motion = steady_motion(Biped.load("biped"), nominal_mpc(written, written.gait.stride, None))
    assert isinstance(motion, SteadyMotion)
    assert np.abs(motion.torques)[:, [3, 9]].max() <= 37.0
    knee = next(line for line in place.read_text().splitlines() if "knee_pitch" in line).split("knee_pitch ")[1]
    assert float(knee.split(",")[0]) <= 36.0


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"aim": "style"}, "aim: must be one of torque, zmp, speed, push"),
        ({"joint": "elbow"}, "joint: must be one of hip_yaw"),
        ({"aim": "zmp", "joint": "knee_pitch"}, "joint: belongs to the aim torque"),
        ({"keys": ["stride"]}, "keys: for the aim torque these are searched: com_height_phase"),
        ({"confirmed": 0}, "confirmed: must be 1 or more"),
    ],
)
def test_what_can_not_be_searched_is_one_sentence(options: dict[str, Any], error: str) -> None:
    with pytest.raises(InputError, match=error):
        tune(load_scenario("walking"), **options)


def test_only_a_robot_that_walks_on_can_be_tuned() -> None:
    for name, text in (("vhip", ""), ("walking", "gait: {walk_steps: 3}")):
        with pytest.raises(InputError, match="a robot's walk without an end is needed"):
            tune(load_scenario(name, text))
    with pytest.raises(InputError, match=r"gait\.stride: must not be 0"):
        tune(load_scenario("walking", "gait: {stride: 0.0}"), aim="speed")


@pytest.mark.parametrize(("ticks", "phases"), [(40, (4, 24)), (36, (4, 22))])
def test_pushes_that_confirm_a_gait_begin_in_both_halves_of_a_step(
    ticks: int, phases: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    handed: list[Work] = []

    def measured(measuring: object, work: list[Work], workers: int) -> list[GaitMeasures]:
        handed.extend(work)
        return [gait()._replace(values=piece.values) for piece in work]

    monkeypatch.setattr("pdhocbf_drake.studies.tune.study.in_processes", measured)
    found = tune(varied(load_scenario("walking"), {"ticks_per_step": ticks}), aim="push", keys=["com_height"])
    assert {(piece.phases, piece.directions) for piece in handed} == {(phases, ("+x", "-x", "+y", "-y"))}
    assert not found.asked


def test_a_robot_that_is_always_asked_too_much_is_told_of(monkeypatch: pytest.MonkeyPatch) -> None:
    def measured(measuring: object, work: list[Work], workers: int) -> list[GaitMeasures]:
        knee = {role: 0.97 * limits.effort[role] if role == "knee_pitch" else 0.1 for role in ROLES}
        return [gait(torque=knee, joint_speed=dict.fromkeys(ROLES, 0.1))._replace(values=w.values) for w in work]

    scenario = load_scenario("walking")
    limits = JointLimits.of(Biped.load(scenario.robot))
    monkeypatch.setattr("pdhocbf_drake.studies.tune.study.in_processes", measured)
    assert tune(scenario, keys=["com_height"]).asked == "knee_pitch uses 97 % of its torque"
