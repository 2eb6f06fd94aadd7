"""What the joints' PD is predicted to add to a planned torque, from what it has added."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake import load_scenario
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.robot.grip import Grip
from pdhocbf_drake.simulation.biped_plant import standing_posture
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.systems.inverse_kinematics import InverseKinematics
from pdhocbf_drake.whole_body.config import WholeBodyConfig
from pdhocbf_drake.whole_body.kernels import JOINTS, TABLE, learn
from pdhocbf_drake.whole_body.memory import BodyMemory

TICKS = 6  # of a gait
NOTHING = np.zeros(JOINTS)


def shown(memory: np.ndarray, tick: int, added: np.ndarray, stands: bool = False) -> None:
    learn(memory, tick, added + 3.0, np.full(JOINTS, 3.0), stands)


def test_what_has_been_walked_predicts_and_before_that_the_last_tick_does() -> None:
    rng, memory = np.random.default_rng(0), BodyMemory.start(NOTHING, TICKS)
    stand, gait, next_gait = rng.normal(size=JOINTS), *rng.normal(size=(2, TICKS, JOINTS))
    for tick in range(TICKS):
        shown(memory, tick, stand, stands=True)
    np.testing.assert_allclose([BodyMemory.of(memory).added(tick) for tick in range(TICKS)], [stand] * TICKS)
    before = stand
    for tick, added in enumerate(gait[:-1]):
        shown(memory, tick, added)
        np.testing.assert_allclose(BodyMemory.of(memory).added(tick + 1), added + 0.5 * (added - before))
        before = added
    shown(memory, TICKS - 1, gait[-1])
    for tick, added in enumerate(next_gait[:-1]):
        shown(memory, tick, added)
        predicted = gait[tick + 1] + 0.5 * (added - gait[tick])
        np.testing.assert_allclose(BodyMemory.of(memory).added(tick + 1), predicted)


def test_a_torque_that_is_no_number_is_not_learned() -> None:
    memory = BodyMemory.start(NOTHING, TICKS)
    shown(memory, 0, np.arange(JOINTS, dtype=float))
    known, bad = memory.copy(), np.full(JOINTS, np.nan)
    for stands in (False, True):
        shown(memory, 1, bad, stands)
        np.testing.assert_array_equal(memory, known)


def test_a_disturbed_walk_forgets_what_was_added_and_keeps_the_rest() -> None:
    stand = standing_posture(build_walk(load_scenario("walking")), biped := Biped.load("biped"))
    grip, config = Grip.of(biped, stand, 0.8, (0.08, 0.08)), WholeBodyConfig()
    block = InverseKinematics(biped, stand, 0.01, grip=grip, whole_body=config, ticks_per_step=TICKS // 2, forgets=True)
    phase, applied = np.array([1.0, 0.0, 1.0]), np.arange(JOINTS, dtype=float)
    parts = np.zeros(sum(block.parts.values()))
    for reason, learns in ((Reason.SOLVED, True), (Reason.RECOVERING, False), (Reason.NO_STEADY_PLAN, False)):
        status = np.array([1.0, 0.0, 0.0, 0.0, 0.0, float(reason)])
        known = block.learned(block.start, phase, parts, applied)
        after = block.learned(known, phase, parts, applied, status)
        memory = BodyMemory.of(after[-(TABLE + JOINTS * TICKS) :])
        added = [memory.added(tick) for tick in range(TICKS)]
        assert np.any(added) == learns
        np.testing.assert_array_equal(after[: -JOINTS * (TICKS + 1)], block.start[: -JOINTS * (TICKS + 1)])
