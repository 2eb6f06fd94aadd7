"""What hips and knees leave to a disturbed walk: the ZMP that they hold, and how far a landing is moved."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from walks import make_mpc, start, walk

from pdhocbf_drake.fitting.held_zmp import HeldZmp, held_zmp
from pdhocbf_drake.fitting.plan_limits import plan_limits
from pdhocbf_drake.fitting.swing_acceleration import swing_acceleration
from pdhocbf_drake.mpc.config import PlanLimits, RecoveryConfig
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.mpc.recovery import recovery_of
from pdhocbf_drake.robot import Biped, Posture, WholeBodyIk, sole_pose
from pdhocbf_drake.robot.leg import axis_of
from pdhocbf_drake.simulation.limits import within_limits
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.limits.foreseen import survived
from pdhocbf_drake.studies.limits.weak import write_weak
from pdhocbf_drake.walking import GaitConfig
from pdhocbf_drake.walking.com_height import CosineHeight

GAIT = GaitConfig(stride=0.1, com_height_phase="middle")
FAR = {"zmp_behind": 1.0, "zmp_ahead": 1.0, "zmp_inward": 1.0, "zmp_outward": 1.0, "step_reach": (0.45, 0.64)}
KNEE = 33.8  # N m, 0.8 of what the packaged walk takes


def weak(folder: Path, role: str, torque: float) -> Biped:
    file = folder / f"{role}.yaml"
    return Biped.load(write_weak(load_scenario("walking_nobarrier"), (role, torque), None, file).robot)


def test_a_strong_leg_holds_the_zmp_anywhere() -> None:
    biped = Biped.load("biped")
    assert held_zmp(biped, GAIT) == ()
    assert swing_acceleration(biped, GAIT) > RecoveryConfig().swing_acceleration


@pytest.mark.parametrize("knee", [30.0, 38.0])
def test_a_knee_at_its_limit_holds_the_zmp_below_the_com_with_the_moment_of_the_weight(
    tmp_path: Path, knee: float
) -> None:
    """Where the CoM doesn't accelerate ahead: the moment about the knee of the ground's force, shank and foot."""
    gait, places = GaitConfig(com_height_amplitude=0.0), np.linspace(-0.06, 0.09, 16)
    biped = weak(tmp_path, "knee_pitch", knee)
    held, ik = HeldZmp.of(biped, gait, ("knee_pitch",), places, 1.0), WholeBodyIk(biped)
    np.testing.assert_array_equal(held.high, 0.1)
    c = float(np.interp(0.0, places - held.low[7], places))
    feet, context = (sole_pose(0.0, 0.08), sole_pose(2.0 * c, -0.08)), biped.plant.CreateDefaultContext()
    biped.plant.SetPositions(context, ik.solve(Posture(np.array([c, 0.0, 0.58]), *feet), biped.bent_knee).q)
    place, axis = axis_of(biped, context, biped.joint_names[3])
    force = biped.mass * np.array([0.0, -float(CosineHeight(gait).eta()[0]) * 0.08, 9.81])
    moment = np.cross([c - place[0], 0.08 - place[1], -place[2]], force)
    for body in (biped.plant.GetBodyByName(f"left_{link}") for link in ("shank", "ankle", "foot")):
        middle = biped.plant.EvalBodyPoseInWorld(context, body) @ body.default_com()
        moment += np.cross(middle - place, [0.0, 0.0, -9.81 * body.default_mass()])
    assert abs(axis @ moment) == pytest.approx(knee, abs=0.5)


def test_a_landing_is_moved_in_proportion_to_the_hips_torque(tmp_path: Path) -> None:
    one, half = (swing_acceleration(weak(tmp_path, "hip_pitch", torque), GAIT) for torque in (16.0, 8.0))
    assert one == pytest.approx(2.0 * half)
    assert one < RecoveryConfig().swing_acceleration


def test_a_disturbed_walk_keeps_its_zmp_where_it_is_held_and_a_steady_one_does_not() -> None:
    low = np.where((np.arange(40) < 10) | (np.arange(40) > 30), 0.04, -0.05)
    limits = FAR | {"zmp_held": tuple((float(end), 0.1) for end in low), "zmp_middle": (0.02, 0.0)}
    mpc = make_mpc(gait={"stride": 0.1}, mpc={"limits": limits, "recovery": {"zmp_box": (0.2, 0.12)}})
    memory, below = start(mpc), 0
    for tick, state, stance, plan in walk(mpc, 260, memory):
        below += bool(tick > 160 and state[0, 2] - stance[0, 1] < low[tick % 40] - 1e-6)
        if tick < 180 or tick % 7:
            continue
        pushed = state + np.array([[0.0, -0.25, 0.0], [0.0, 0.0, 0.0]])
        found = mpc.solve(tick, pushed, stance, mpc.bounds(tick), None, plan, True)
        assert found.reason == Reason.RECOVERING
        zmp = state[0, 2] + mpc.vhip.tick * np.cumsum(found.inputs[0])
        step, phase = np.divmod(tick + 1 + np.arange(80), 40)
        feet = np.array([stance[0, 1], *found.footholds[0]])[step - tick // 40]
        alone = phase >= 4
        assert (zmp - feet - low[phase])[alone].min() >= -1e-6
        assert (zmp - feet)[alone].min() < 0.0  # the heel, where that is held
    assert below > 20


def test_a_box_that_is_held_as_a_whole_changes_no_plan() -> None:
    limits = FAR | {"zmp_held": ((-0.1, 0.1),) * 40}
    plain, held = (make_mpc(mpc={"limits": some, "recovery": {}}) for some in (FAR, limits))
    for tick, state, stance, plan in walk(plain, 170):
        if tick > 150:
            pushed = state + np.array([[0.0, 0.1, 0.0], [0.0, -0.1, 0.0]])
            plans = [mpc.solve(tick, pushed, stance, mpc.bounds(tick), None, plan, True) for mpc in (plain, held)]
            np.testing.assert_allclose(plans[0].inputs, plans[1].inputs, atol=1e-9)
            np.testing.assert_allclose(plans[0].footholds, plans[1].footholds, atol=1e-9)


def test_the_weaker_of_both_limits_of_a_landing_holds_in_a_disturbed_walk() -> None:
    mpc = make_mpc()
    for given, expected in ((5.0, 5.0), (80.0, 60.0), (None, 60.0)):
        limits = PlanLimits.model_validate(FAR | {"swing_acceleration": given})
        config = mpc.config.model_copy(update={"limits": limits, "recovery": RecoveryConfig()})
        assert recovery_of(mpc.gait, mpc.vhip, config)[2].swing_acceleration == expected


def test_weaker_joints_leave_less_to_a_plan_that_foresees_a_push(tmp_path: Path) -> None:
    scenario, found = load_scenario("walking_nobarrier", "gait: {stride: 0.1}"), list[float]()
    for knee in (150.0, 30.0):
        biped = weak(tmp_path, "knee_pitch", knee)
        limits = plan_limits(biped, scenario.gait)
        walked = scenario.model_copy(update={"mpc": scenario.mpc.model_copy(update={"limits": limits})})
        found.append(survived(walked, biped, -1.0, (0,))[0])
    assert found[1] < 0.8 * found[0]
    assert found[0] > 24.0  # what the robot survives


def test_the_limits_of_a_disturbed_walk_are_written_with_the_scenario(tmp_path: Path) -> None:
    biped = weak(tmp_path, "knee_pitch", KNEE)
    scenario = load_scenario("walking_nobarrier").model_copy(update={"robot": str(tmp_path / "knee_pitch.yaml")})
    kept = within_limits(scenario, biped).scenario
    assert kept.mpc.plan_limits is not None
    assert len(kept.mpc.plan_limits.zmp_held) == kept.gait.ticks_per_step
    assert type(kept).from_dict(kept.to_dict(), "again") == kept
