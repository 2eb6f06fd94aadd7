"""Feet that feel the ground: what the targets of the soles do when ground is met early, late, tilted, or as planned."""

from __future__ import annotations

import numpy as np
import pytest
from walks import make_mpc

from pdhocbf_drake import simulate
from pdhocbf_drake.estimation.sample import Notice
from pdhocbf_drake.mpc.late_landing import expected
from pdhocbf_drake.simulation.run_log import FELL, FINISHED
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.systems.foot_loads import SensedLoads
from pdhocbf_drake.systems.footing import Footing
from pdhocbf_drake.systems.signals import places
from pdhocbf_drake.walking import Gait, GaitConfig
from pdhocbf_drake.walking.swing import Swing

WEIGHT, DELTA = 300.0, 0.01
GAIT = Gait(GaitConfig(start_steps=0))
N, LIFT_OFF = GAIT.period, GAIT.lift_off(0)
STANDING, SWINGING = (0, 1) if GAIT.support(0) > 0 else (1, 0)
PLAN = np.array([0.0, 0.08, 0.0, 0.08, 0.0, -0.08, 0.0, -0.08])  # in place
ALOFT = places("ground_target", "left_aloft", "right_aloft")
ROLL = places("ground_target", "left_roll", "right_roll")
Z = (2, 11)  # of the soles in foot_target


class Walk:
    """Steps in place, planned on level ground, of soles that do as told until something stops them.

    `ground` is the height of the ground [m] and `roll` its tilt under the foot that lands.
    """

    def __init__(self, ground: float, roll: float = 0.0, delay: int = 0) -> None:
        self.footing, self.swing = Footing(GAIT, (0.05 * WEIGHT, 0.14 * WEIGHT), delay), Swing(GAIT)
        self.ground, self.roll = {STANDING: 0.0, SWINGING: ground}, {STANDING: 0.0, SWINGING: roll}
        self.memory, self.before, self.rows = self.footing.start, np.zeros(18), []

    def run(self, ticks: int, broken: range = range(0)) -> np.ndarray:
        """Walks on; of each tick so far heights of the soles' targets, in the air, rolls, the CoM's line (2), and by
        how much the landing is delayed (n, 9).
        """
        for k in range(len(self.rows), len(self.rows) + ticks):
            step, tick = divmod(k, N)
            phase = np.array([tick, step, GAIT.support(step)], dtype=float)
            feet = self.swing.feet(tick, phase[2], PLAN, self.before)
            sole, ground, late = self.footing.targets(self.memory, phase, feet, None, GAIT)
            self.rows.append([*sole[list(Z)], *ground[ALOFT], *ground[ROLL], *ground[:2], *late])
            measured, loads = np.zeros(12), np.zeros(2)
            for foot in (0, 1):
                z = max(sole[Z[foot]], self.ground[foot])
                measured[6 * foot : 6 * foot + 3] = [*sole[9 * foot : 9 * foot + 2], z]
                loads[foot] = 150.0 * (sole[Z[foot]] <= self.ground[foot] + 1e-9)
                measured[6 * foot + 3] = self.roll[foot] if loads[foot] else 0.0
            if k in broken:
                measured[:] = np.nan
            self.memory = self.footing.felt(self.memory, phase, feet, None, GAIT, measured, loads)
            self.before = feet
        return np.array(self.rows)


def test_ground_as_planned_changes_nothing():
    rows = Walk(0.0).run(3 * N)
    before, planned = np.zeros(18), []
    for k in range(3 * N):
        before = Swing(GAIT).feet(k % N, GAIT.support(k // N), PLAN, before)
        planned.append(before[list(Z)])
    assert rows[:, :2] == pytest.approx(np.array(planned), abs=1e-12)
    assert (rows[:, 2:4] == (rows[:, :2] > 0.0)).all()
    assert not rows[:, 4:].any()


def test_a_foot_stops_where_it_meets_the_ground_early():
    height = 0.012
    rows = Walk(height).run(2 * N)
    z, in_air = rows[:, SWINGING], rows[:, 2 + SWINGING]
    met = np.flatnonzero((z[:-1] <= height) & (np.arange(len(z) - 1) > N // 2))[0] + 1
    assert met < N
    assert z[met + 1 :] == pytest.approx(height, abs=1e-9)
    assert not in_air[met + 1 :].any()
    t = 9.0 * (N - 1) * DELTA  # the line under the CoM has come up, critically damped
    assert rows[-1, 6] == pytest.approx(height * (1.0 - (1.0 + t) * np.exp(-t)), rel=0.05)


def test_a_foot_goes_on_down_until_it_meets_the_ground():
    depth = 0.02
    rows = Walk(-depth).run(2 * N)
    z, in_air = rows[N:, SWINGING], rows[N:, 2 + SWINGING]
    speed = -np.diff(z) / DELTA
    assert z.min() == pytest.approx(-depth, abs=0.5 * DELTA)
    assert speed.max() == pytest.approx(0.5)
    landed = int(np.flatnonzero(z <= -depth + 1e-9)[0])
    assert landed == pytest.approx(2 + depth / 0.5 / DELTA, abs=1.5)
    assert in_air[3:landed].all()
    assert not in_air[landed + 1 :].any()


def test_the_other_foot_waits_for_one_that_comes_late_and_then_catches_up():
    walk, in_time = Walk(-0.04), Walk(0.0).run(2 * N)[N:]
    walk.run(N + N // 2)
    walk.ground[STANDING] = -0.1
    late = walk.run(N // 2)[N:]
    in_air = late[:, 2:4] > 0.0
    landed = int(np.flatnonzero(in_air[:, SWINGING])[-1]) + 1
    begun = int(np.flatnonzero(in_air[:, STANDING])[0])
    assert begun - LIFT_OFF - 1 == pytest.approx(landed - 1, abs=1.0)
    assert not late[: begun - 1, STANDING].any()
    assert in_air[begun:, STANDING].all()
    assert np.abs(np.diff(late[:, STANDING])).max() < 1.3 * np.abs(np.diff(in_time[:, STANDING])).max()
    assert late[-1, STANDING] == pytest.approx(in_time[-1, STANDING] - 0.04, abs=2e-3)


def test_a_late_landing_delays_the_zmp_until_the_next_step():
    rows = Walk(-0.02).run(2 * N)
    delay, waits = rows[N:, 8], np.flatnonzero(rows[N:, 2 + SWINGING])[2:]
    assert not rows[:N, 8].any()
    assert (delay[waits] > waits).all()
    assert set(delay[waits[-1] + 1 :]) == {waits[-1] - 1.0}
    assert not Walk(0.012).run(2 * N)[:, 8].any()


def test_the_box_comes_as_much_later_as_the_foot():
    mpc, step, late = make_mpc(), 4, 6
    stance = np.array([[0.0, 0.15], [0.08, -0.08]])
    for phase in (2, late, N - 2):
        tick = step * N + phase
        learned = np.full((2, mpc.config.horizon), 0.01)
        offset, behind = expected(mpc, tick, stance, float(late), learned)
        for axis in (0, 1):
            stances = np.array([stance[axis, 0], *[stance[axis, 1]] * 4])
            centre = mpc.gait.region.centres(stances, N)
            then = np.concatenate([np.full(late, stance[axis, 0]), centre])
            ticks = np.arange(phase + 1, N)
            swings = ticks > mpc.gait.config.double_support_ticks + late
            assert centre[ticks] - offset[axis, : len(ticks)] + 0.01 * swings == pytest.approx(then[ticks])
            assert offset[axis, len(ticks) :] == pytest.approx(0.01)
            assert behind[axis] == pytest.approx(centre[phase + 1] - then[phase + 1])


def test_a_foot_that_finds_no_ground_goes_no_deeper_than_a_step():
    assert Walk(-1.0).run(2 * N)[:, SWINGING].min() >= -0.08


def test_the_next_swing_expects_the_ground_of_the_stance_foot():
    walk = Walk(0.012)
    walk.run(N + LIFT_OFF + 1)
    walk.ground[STANDING] = 0.0  # lower than it expects, so that nothing stops it
    rows = walk.run(N - LIFT_OFF - 1)
    assert rows[-1, STANDING] == pytest.approx(0.012, abs=1e-3)


def test_a_sole_takes_the_tilt_that_it_meets_and_turns_back_in_its_swing():
    tilt = 0.03
    walk = Walk(0.0)
    walk.run(N // 2)
    walk.roll[SWINGING] = tilt
    rows = walk.run(3 * N - N // 2)
    roll = rows[:, 4 + SWINGING]
    assert roll[:N] == pytest.approx(0.0)
    assert roll[2 * N - 1] == pytest.approx(tilt, rel=1e-3)
    assert np.abs(np.diff(roll[2 * N + LIFT_OFF + 1 :])).max() < 0.2 * tilt
    assert roll[2 * N + LIFT_OFF + round(0.6 * (N - LIFT_OFF)) : 3 * N] == pytest.approx(0.0, abs=1e-9)
    assert not rows[:, 4 + STANDING].any()


def test_what_is_not_finite_is_not_felt():
    rows = Walk(0.012).run(3 * N, broken=range(2 * N))
    assert np.isfinite(rows).all()
    assert rows[: 2 * N, :2].min() >= 0.0


@pytest.mark.parametrize("notice", [Notice.NONE, Notice.SLIP, Notice.FORCE_TORQUE, Notice.FLICKER | Notice.SLIP])
def test_forces_that_are_not_trusted_are_no_loads(notice: Notice):
    block = SensedLoads()
    context = block.CreateDefaultContext()
    block.get_input_port(0).FixValue(context, np.arange(12.0))
    block.get_input_port(1).FixValue(context, np.array([float(notice), *np.zeros(7)]))
    found = block.get_output_port().Eval(context)
    trusted = not notice & (Notice.FORCE_TORQUE | Notice.FLICKER)
    assert found == pytest.approx([5.0, 11.0] if trusted else [np.nan] * 2, nan_ok=True)


STEP = "{kind: stairs, at: 0.6, rise: -0.02, tread: 3.0, count: 1, known: false}"
TILES = "{kind: rough, from: 0.5, to: 1.0, size: 0.1, amplitude: 0.01, seed: 3, known: false}"


@pytest.mark.parametrize("piece", [STEP, TILES])
def test_a_robot_walks_over_what_is_on_no_map(piece: str):
    scenario = load_scenario("walking", f"{{duration: 4.0, plant: {{time_step: 0.005}}, ground: [{piece}]}}")
    log = simulate(scenario)
    terrain, settled = scenario.terrain, log.element("gait_phase", "tick") == 20
    assert log.ending == FINISHED
    assert log.element("lip_state", "x")[-1] > 1.0
    for side, stands in (("left", 1.0), ("right", -1.0)):
        rows = np.flatnonzero(settled & (log.element("gait_phase", "support") == stands))
        learned = log.element("foot_target", f"{side}_z")[rows]
        assert learned == pytest.approx(log.element("foot_state", f"{side}_z")[rows], abs=2e-3)
    assert piece != STEP or np.abs(log["robot_state"][:, 1:3]).max() < np.sin(np.radians(1.5))  # the torso's tilt / 2
    assert piece != STEP or learned[-1] == pytest.approx(terrain.height(1.2, 0.0, known=False), abs=2e-3)


def test_the_same_robot_falls_over_a_step_that_its_feet_do_not_feel():
    text = f"{{duration: 4.0, plant: {{time_step: 0.005}}, biped: {{feels_ground: false}}, ground: [{STEP}]}}"
    assert simulate(load_scenario("walking", text)).ending == FELL
