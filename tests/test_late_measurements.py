"""Late measurements: carried forward exactly on the template, with the feet, the ZMP's lag and what is carried."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from walks import make_mpc, repacked, start

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.loop import Measurement, control, walk_template
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.mpc.prediction import carried_back, carry_forward, zmp_before
from pdhocbf_drake.simulation.checks import check_scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.walking.vhip import Vhip

SMALL = {"ticks_per_step": 10, "double_support_ticks": 1, "stride": 0.02, "com_height_amplitude": 0.002}
QUICK = {"horizon": 20, "freeze_ticks": 2}
rng = np.random.default_rng(0)


def walked(delay: int, ticks: int = 45, first: int = 0, memory=None, **settings) -> list:
    mpc = make_mpc(SMALL, QUICK | {"delay": delay} | settings)
    return list(walk_template(mpc, memory or start(mpc), first, ticks))


@pytest.mark.parametrize("flow", ["euler", "exact"])
@pytest.mark.parametrize("delay", [1, 4, 13])
def test_a_state_carried_forward_is_the_state_of_now(flow: str, delay: int) -> None:
    vhip = Vhip(17.0 + np.arange(6.0), 0.01, flow)
    states, sent = [rng.normal(size=(2, 3))], rng.normal(size=(2, delay))
    for j in range(delay):
        states.append(vhip.step_axes(9 + j, states[-1], sent[:, j]))
    state = states[0].copy()
    carry_forward(vhip.A, vhip.B, 9, sent, state)
    np.testing.assert_allclose(state, states[-1], atol=1e-13)
    np.testing.assert_allclose(zmp_before(state[:, 2], sent, 0.01), states[0][:, 2], atol=1e-14)
    np.testing.assert_allclose(carried_back(vhip, 9 + delay, sent, states[-1]), states[:-1], atol=1e-12)


@pytest.mark.parametrize("delay", [1, 4, 20])
def test_a_walk_with_late_measurements_is_the_walk_without(delay: int) -> None:
    exact, late = walked(0), walked(delay)
    np.testing.assert_allclose([tick.state for tick in late], [tick.state for tick in exact], atol=1e-9)
    assert {tick.plan.reason for tick in late} == {Reason.SOLVED}


def test_a_delay_stated_wrong_by_a_tick_is_walked_with_and_stated_right_is_not_noticed() -> None:
    mpc = make_mpc(SMALL, QUICK | {"delay": 2})
    ends = []
    for true in (1, 2, 3):
        memory, states = start(mpc), [start(mpc).state]
        for k in range(45):
            memory, _ = control(mpc, memory, Measurement(k, states[max(0, k - true)]))
            states.append(mpc.vhip.step_axes(k, states[-1], memory.zmp_reference[1::2]))
        ends.append(states[-1][0])
    exact = walked(0, 46)[-1].state[0]
    np.testing.assert_allclose(ends[1], exact, atol=1e-9)
    for wrong in (ends[0], ends[2]):
        assert 1e-4 < abs(wrong[0] - exact[0]) < 0.01


def test_a_late_foot_is_put_where_it_is_measured_once_it_is_seen_on_the_ground() -> None:
    mpc = make_mpc(SMALL, QUICK | {"delay": 3})
    (*_, last) = walk_template(mpc, start(mpc), 0, 40)
    memory, landed = last.memory, last.memory.feet + 0.004
    for k in range(40, 45):
        before = memory.feet
        memory, _ = control(mpc, memory, Measurement(k, carried_back(mpc.vhip, k, memory.beliefs.sent, memory.state)[0],
                                                     feet=landed))  # fmt: skip
        assert np.array_equal(memory.feet, before) == (k != 43)
    moved = np.abs(memory.feet - landed).max(axis=1)
    assert sorted(moved < 1e-12) == [False, True]  # the foot that had just come down


@pytest.mark.parametrize("settings", [{}, {"zmp_lag": 25.0, "disturbance": {}, "filter": {"com": 0.005}}])
def test_a_memory_packed_in_mid_walk_goes_on_bit_for_bit(settings: dict) -> None:
    ticks = walked(3, **settings)
    mpc = make_mpc(SMALL, QUICK | {"delay": 3} | settings)
    again = list(walk_template(mpc, repacked(mpc, ticks[24].memory), 25, 20))
    # The walk that goes on knows the measurements of before from what was sent, to the last bits of a division.
    np.testing.assert_allclose([t.state for t in again], [t.state for t in ticks[25:]], atol=1e-12)
    packed = repacked(mpc, ticks[24].memory)
    measured = Measurement(25, ticks[22].state)
    one, other = (control(mpc, memory, measured)[0] for memory in (ticks[24].memory, packed))
    for name in ("com_reference", "zmp_reference", "state", "stance_plan"):
        assert np.array_equal(getattr(one, name), getattr(other, name))
    assert all(np.array_equal(a, b) for a, b in zip(one.beliefs, other.beliefs, strict=True))


def test_a_zmp_that_lags_is_led_by_as_much() -> None:
    exact, lags = walked(0), walked(0, zmp_lag=25.0)
    np.testing.assert_allclose([t.state for t in lags], [t.state for t in exact], atol=1e-9)
    for tick, after in itertools.pairwise(lags):
        sent = tick.memory.zmp_reference[::2]
        follows = (1.0 - np.exp(-0.25)) * (sent - tick.state[:, 2])
        np.testing.assert_allclose(after.state[:, 2], tick.state[:, 2] + follows, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mpc: {delay: -1}", "vhip.mpc.delay: must be from 0 to 1000 ticks (given: -1)"),
        ("mpc: {delay: soon}", "vhip.mpc.delay: must be a whole number or 'auto' (given: 'soon')"),
        ("mpc: {delay: 81}", "mpc.delay: must be at most mpc.horizon, 80 ticks (given: 81)"),
        (
            "measurement: {delay_ticks: 90}",
            "measurement.delay_ticks: must be at most mpc.horizon, 80 ticks, or mpc.delay must be a number: what is "
            "measured is carried forward by as much (given: 90)",
        ),
        ("mpc: {zmp_lag: 0}", "vhip.mpc.zmp_lag: must be above 0 and up to 10000 1/s (given: 0)"),
        ("mpc: {filter: {com: -1}}", "vhip.mpc.filter.com: must be from 0 to 1 m (given: -1)"),
    ],
)
def test_a_delay_lag_or_noise_that_can_not_be_is_refused(text: str, message: str) -> None:
    with pytest.raises(InputError) as error:
        check_scenario(load_scenario("vhip", text))
    assert str(error.value) == message
