"""Friction: what soles carry, the torso's yaw that gives way, the cautious gait, and the stride that is granted."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pdhocbf_drake.analysis.feet import slip_max
from pdhocbf_drake.analysis.path_metrics import torso_yaw
from pdhocbf_drake.errors import InputError, ModelError
from pdhocbf_drake.robot import Biped, InverseDynamics, WholeBodyIk, sole_pose, upright_posture
from pdhocbf_drake.robot.feedforward import torso_yaw_lever
from pdhocbf_drake.robot.grip import Grip
from pdhocbf_drake.robot.kernels import use_of_ground
from pdhocbf_drake.robot.posture import TORSO_TURN
from pdhocbf_drake.simulation.limits import within_limits
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.systems.torso_yaw import FASTEST, TorsoYaw

COARSE = "plant: {time_step: 0.005}"
GRIP = Grip(friction=0.1, radius=0.08, lever=6e-4)


def test_a_sole_turns_at_the_moment_of_its_four_loads_and_sooner_under_a_horizontal_force() -> None:
    assert GRIP.largest_moment(0.0) == pytest.approx(0.8 * 0.1 * 0.08)
    assert GRIP.largest_moment(0.06) == pytest.approx(0.8 * GRIP.largest_moment(0.0))
    assert GRIP.largest_moment(0.1) == GRIP.largest_moment(0.5) == 0.0
    biped = Biped.load("biped")
    q = upright_posture(biped, np.array([0.0, 0.0, 0.58]), sole_pose(0.0, 0.08), sole_pose(0.0, -0.08))
    centred = Grip.of(biped, q, 0.1, (1e-9, 1e-9))
    assert centred.radius == pytest.approx(math.hypot(0.1, 0.06))
    assert Grip.of(biped, q, 0.1, (0.1, 0.1)).radius < centred.radius


def test_the_lever_is_how_the_torsos_yaw_changes_the_moment() -> None:
    biped = Biped.load("biped")
    left, right = sole_pose(0.0, 0.08), sole_pose(0.0, -0.08)
    q = upright_posture(biped, np.array([0.02, -0.05, 0.58]), left, right)
    lever, ik, rest = torso_yaw_lever(biped, q), WholeBodyIk(biped), np.zeros(18)
    dynamics = InverseDynamics(biped, ik.task_space)
    moments = []
    for yaw in (-3.0, 5.0):
        wanted = rest.copy()
        wanted[TORSO_TURN.start + 2] = yaw
        found = dynamics(q, rest, ik.derivatives(q, rest, wanted)[1], 0.0)
        moments.append(use_of_ground(found.left, left[:3], found.right, right[:3])[1])
    assert moments[1] - moments[0] == pytest.approx(8.0 * lever, rel=1e-6)


def test_the_torso_gives_way_only_as_far_as_it_must() -> None:
    yaw, most = TorsoYaw(0.1, -0.2), GRIP.largest_moment(0.05)
    assert yaw.yielding(GRIP, 3.0, 0.05, 0.9 * most) == 3.0
    for moment in (0.02, -0.02):
        given = yaw.yielding(GRIP, 3.0, 0.05, moment)
        assert moment + GRIP.lever * (given - 3.0) == pytest.approx(math.copysign(most, moment))


@pytest.mark.parametrize("moment", [0.2, -30.0, 1e9, -1e18, math.inf])
@pytest.mark.parametrize("used", [0.0, 0.05, 1e15])
def test_it_never_gives_way_faster_than_a_torso_can(moment: float, used: float) -> None:
    given = TorsoYaw(0.1, -0.2).yielding(GRIP, 3.0, used, moment)
    assert given == -math.copysign(FASTEST, moment)


def test_a_plan_that_hardly_loads_the_soles_asks_no_joint_for_the_impossible() -> None:
    push = "{time: 2.4, duration: 0.1, force: [-230.0, 0.0, 0.0]}"
    text = f"{{gait: {{stride: 0.1}}, duration: 3.2, pushes: [{push}], {COARSE}}}"
    log = simulate(load_scenario("walking_nobarrier", text))
    assert log.ending == "finished"
    assert np.abs(log["feedforward"]).max() < 1e3


def test_the_torso_comes_back_to_rest() -> None:
    yaw = TorsoYaw(0.2, 1.0)
    for _ in range(600):
        yaw = yaw.after(yaw.returning, 0.01)
    assert yaw == TorsoYaw(0.0, 0.0)


def test_on_a_slippery_ground_the_walk_goes_on_at_full_speed() -> None:
    scenario = load_scenario("walking_nobarrier", f"{{duration: 3.6, friction: 0.1, {COARSE}}}")
    log = simulate(scenario)
    assert log.ending == "finished"
    assert slip_max(log) < 0.002
    assert 2.0 < np.degrees(np.abs(torso_yaw(log, (1.0, 0.0, 0.0))).max()) < 20.0
    assert log.after(2.4).element("lip_state", "vx")[:80].mean() == pytest.approx(0.375, abs=0.01)


def test_where_friction_does_not_do_the_gait_gets_cautious_and_slower() -> None:
    biped = Biped.load("biped")
    straight = within_limits(load_scenario("walking_nobarrier", "friction: 0.06"), biped)
    gait = straight.scenario.gait
    assert gait.zmp_box == (0.1, 0.12)
    assert gait.com_height_amplitude == 0.0
    assert 0.05 <= gait.stride / 0.4 < 0.375
    changed, granted = straight.sentences
    assert changed.endswith("the soles need a friction of 0.075, and 0.9 of 0.06 is there")
    assert granted.startswith(f"a stride of {gait.stride:.3g} m is granted instead of 0.15 m")
    text = "{friction: 0.06, commands: [{time: 0.5, velocity: [0.375, 0.0], turn: 0.3}]}"
    turning = within_limits(load_scenario("walking_nobarrier", text), biped).scenario
    assert turning.mpc.plan_limits is not None
    assert turning.mpc.plan_limits.stride is not None
    assert 0.02 <= turning.mpc.plan_limits.stride < gait.stride  # the turn asks for friction too


def test_ice_is_refused_with_what_is_missing() -> None:
    scenario = load_scenario("walking_nobarrier", "friction: 0.02")
    with pytest.raises(ModelError, match=r"not even in place: the soles need a friction of 0\.0\d+, and 0\.9 of 0\.02"):
        within_limits(scenario, Biped.load("biped"))


@pytest.mark.parametrize("belief", ["0", "-0.1", "11"])
def test_a_belief_that_is_no_friction_is_one_sentence(belief: str) -> None:
    with pytest.raises(InputError, match="friction_belief: must be"):
        load_scenario("walking", f"friction_belief: {belief}")
