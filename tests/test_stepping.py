"""A stand that only a step saves: footsteps in place of it, and the template that takes them."""

from __future__ import annotations

import numpy as np
import pytest
from walks import make_mpc, repacked, start

from pdhocbf_drake.mpc.config import RecoveryConfig
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.loop import walk_template
from pdhocbf_drake.walking import Gait, GaitConfig
from pdhocbf_drake.walking.footsteps import AS_COMMANDED, Resumed
from pdhocbf_drake.walking.swing import Swing

STANDS = 6 * 40  # the tick from which on a walk of four steps stands


@pytest.fixture(scope="module")
def mpc() -> PeriodicMpc:
    recovery = RecoveryConfig(zmp_box=(0.18, 0.11))
    return make_mpc({"walk_steps": 4, "stride": 0.1}, {"recovery": recovery, "zmp_centre_weight": 30.0})


def kicked(mpc: PeriodicMpc, tick: int, velocity: tuple[float, float], ticks: int = 700):  # type: ignore[no-untyped-def]
    kicks = np.zeros((tick + 1, 2))
    kicks[tick] = velocity
    return list(walk_template(mpc, start(mpc), 0, ticks, kicks))


def test_steps_in_place_of_a_stand_alternate_and_leave_all_others_as_they_are() -> None:
    gait = Gait(GaitConfig(walk_steps=3))
    other = gait.resumed_by(Resumed(7 * 40 + 9, 1, 8))
    assert [other.support(j) for j in range(11)] == [0, 0, -1, 1, -1, 0, 0, 1, -1, 0, 0]
    for j in (*range(7), 9, 10):
        np.testing.assert_array_equal(other.foothold(j), gait.foothold(j))
    for j, side in ((7, 1), (8, -1)):
        np.testing.assert_allclose(other.foothold(j), gait.foothold(6) + np.array([0.0, side * 0.08]))
    assert (other.lift_off(6), other.lift_off(7), other.lift_off(8)) == (4, 9, 4)
    assert other.resumed_by(AS_COMMANDED).support(7) == 0


def test_a_stand_alone_takes_no_step(mpc: PeriodicMpc) -> None:
    stand = Gait(GaitConfig(walk_steps=0))
    assert not any(stand.support(j) for j in range(50))
    quiet = kicked(mpc, 0, (0.0, 0.0))
    assert all(tick.memory.resumed == AS_COMMANDED for tick in quiet)
    assert not any(tick.plan.recovering for tick in quiet)


@pytest.mark.parametrize("tick", [STANDS - 25, STANDS - 5, STANDS + 3, STANDS + 20, STANDS + 34])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_kick_that_no_zmp_balances_is_stepped_out_of_and_the_walk_stands_again(
    mpc: PeriodicMpc, tick: int, way: float
) -> None:
    ticks = kicked(mpc, tick, (way * 0.45, 0.0))
    last = ticks[-1]
    assert last.memory.resumed != AS_COMMANDED
    assert mpc.resumed_by(last.memory.resumed).gait.support(last.tick // 40) == 0
    assert np.abs(last.state[:, 1]).max() < 0.01
    assert not last.plan.recovering
    left, right = last.memory.feet
    assert left[0] == pytest.approx(right[0], abs=1e-9)
    assert left[1] - right[1] == pytest.approx(0.16, abs=0.03)
    for row in ticks:  # its ZMP never leaves the feet
        low, high = row.memory.zmp_box.reshape(2, 2).T
        assert np.all((row.memory.state[:, 2] >= low - 1e-9) & (row.memory.state[:, 2] <= high + 1e-9))


@pytest.mark.parametrize("tick", [STANDS - 25, STANDS + 20])
def test_a_kick_that_the_zmp_balances_takes_no_step(mpc: PeriodicMpc, tick: int) -> None:
    ticks = kicked(mpc, tick, (0.12, 0.05), 500)
    assert all(row.memory.resumed == AS_COMMANDED for row in ticks)
    assert np.abs(ticks[-1].state[:, 1]).max() < 0.01


def test_a_memory_keeps_the_steps_that_it_takes(mpc: PeriodicMpc) -> None:
    memory = kicked(mpc, STANDS + 20, (0.45, 0.0), STANDS + 30)[-1].memory
    assert memory.resumed.tick >= STANDS + 20
    assert repacked(mpc, memory).resumed == memory.resumed


def test_a_late_swing_lands_when_its_step_ends_and_rises_less() -> None:
    swing, plan = Swing(Gait(GaitConfig())), np.array([0.0, 0.08, 0.1, 0.08, 0.0, -0.08, 0.0, -0.08])
    feet = [np.concatenate([[0.0, 0.08], np.zeros(7), [0.0, -0.08], np.zeros(7)])]
    for tick in range(20, 41):
        feet.append(swing.feet(tick, -1.0, plan, feet[-1], lift_off=20))
    left = np.array(feet)[1:, :9]
    np.testing.assert_array_equal(left[0, :3], [0.0, 0.08, 0.0])
    np.testing.assert_allclose(left[-1], [0.1, 0.08, *np.zeros(7)], atol=1e-12)
    assert left[:, 2].max() == pytest.approx(0.05 * (20 / 36) ** 2)
    np.testing.assert_allclose(np.diff(left[:, 0]), 0.01 * (left[1:, 3] + left[:-1, 3]) / 2, atol=2e-4)
