"""What is declared periodic is compared one period on, once for each phase that is used."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pdhocbf_drake.barriers import (
    Barrier,
    BarrierFilter,
    NonlinearFilter,
    PeriodicAffineSystem,
    check_in_safe_set,
    check_relative_degree,
    in_safe_set,
    input_interval,
    psi,
    record,
)
from pdhocbf_drake.errors import InputError

CART = PeriodicAffineSystem([[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]])
START = np.array([0.1, 0.0])


class Drifting:
    """x⁺ = (1 + ε k) x + 0.1 u, declared with a period of its own."""

    n, m = 1, 1

    def __init__(self, period, drift, vouched=False):
        self.period, self.drift, self.vouched = period, drift, vouched

    def step(self, k, x, u):
        return (1.0 + self.drift * k) * x + 0.1 * u


def wall(drift=0.05, period=1, scale=1.0, **keys):
    return Barrier("w", lambda k, x: scale * (2.0 - drift * k) - x[0], period, [0.5, 0.5], **keys)


DOORS = {
    "BarrierFilter": lambda b: BarrierFilter(CART, [b]),
    "NonlinearFilter": lambda b: NonlinearFilter(CART, [b]),
    "check_relative_degree": lambda b: check_relative_degree(b, CART),
    "check_in_safe_set": lambda b: check_in_safe_set(b, CART, 0, START),
    "in_safe_set": lambda b: in_safe_set(b, CART, 0, START),
    "input_interval": lambda b: input_interval(CART, [b], 0, START),
    "psi": lambda b: psi(b, CART, 0, START, [[0.0]]),
    "record": lambda b: record(b, [START, START]),
    "h": lambda b: b.h(0, START),
}


@pytest.mark.parametrize("door", DOORS)
def test_a_wall_that_drifts_is_refused_wherever_it_is_given(door):
    where = (
        r'^barrier "w": h does not repeat with its period of 1 tick: it is .* at tick 0 and .* at tick 1, at \[.*\]; '
    )
    with pytest.raises(InputError, match=where + "with vouched=True the ticks 0, ..., N-1 are repeated"):
        DOORS[door](wall())


@settings(max_examples=60, deadline=None)
@given(st.floats(-9, 9), st.integers(1, 60), st.booleans())
def test_a_drift_is_found_in_any_unit_and_what_repeats_is_not_refused(decades, period, drifts):
    scale = 10.0**decades

    def h(k, x):
        return scale * (1.5 + np.sin(2 * np.pi * k / period) - 1e-4 * drifts * k) - x[0]

    barrier = Barrier("b", h, period, [0.5])
    states = scale * np.array([[0.0], [1.5], [-0.3]])
    if drifts:
        with pytest.raises(InputError, match="does not repeat"):
            record(barrier, states)
    else:
        found = record(barrier, states)
        assert found.h == pytest.approx([h(k, x) for k, x in enumerate(states)], abs=1e-9 * scale)


def test_a_drift_that_begins_after_a_few_periods_is_found():
    late = Barrier("late", lambda k, x: 1.0 - x[0] - 0.1 * max(0, k - 20), 4, [0.5])
    with pytest.raises(InputError, match=r"does not repeat with its period of 4 ticks: .* at tick 404"):
        late.h(0, START)


def test_a_phase_is_compared_once_and_only_where_it_is_used():
    ticks = []

    def h(k, x):
        ticks.append(k)
        return 1.0 + np.sin(2 * np.pi * k / 1000) - x[0]

    barrier = Barrier("b", h, 1000, [0.5])
    barrier.h(7, START)
    assert len(ticks) <= 16
    assert set(ticks) <= {7, 340, 507, 1007, 101_007}
    ticks.clear()
    for k in (7, 1007, 2007):
        barrier.h(k, START)
    assert ticks == [7, 7, 7]


def test_a_table_of_one_period_is_vouched_for():
    table = [1.0, 2.0, 3.0]
    message = r"raised IndexError \(list index out of range\) at tick 3 or 303; it must take any tick: use k % N"
    with pytest.raises(InputError, match=message):
        Barrier("t", lambda k, x: table[k] - x[0], 3, [0.5]).h(0, START)
    vouched = Barrier("t", lambda k, x: table[k] - x[0], 3, [0.5], vouched=True)
    assert [vouched.h(k, np.zeros(1)) for k in range(-1, 5)] == [3.0, 1.0, 2.0, 3.0, 1.0, 2.0]
    # ... and a drift is then repeated as one has promised
    assert wall(period=2, vouched=True).h(5, np.zeros(2)) == 1.95


def test_h_that_is_not_defined_everywhere_is_compared_where_it_is():
    def h(k, x):
        if x[0] < 0:
            raise ValueError("no depth")
        return np.sqrt(x[0]) - 0.5 + 0.1 * (k % 2)

    assert Barrier("root", h, 2, [0.5]).h(3, np.array([0.25])) == pytest.approx(0.1)


@pytest.mark.parametrize("check", [
    lambda system, b: check_relative_degree(b, system),
    lambda system, b: BarrierFilter(system, [b]),
    lambda system, b: NonlinearFilter(system, [b]),
    lambda system, b: in_safe_set(b, system, 0, [0.5]),
])  # fmt: skip
def test_dynamics_that_do_not_repeat_are_refused_unless_vouched_for(check):
    barrier = Barrier("x", lambda k, x: 1.0 - x[0], 1, [0.5])
    with pytest.raises(InputError, match=r"^the system's step does not repeat with its period of 2 ticks: .*; "
                       r"a system with the attribute vouched = True is not compared$"):  # fmt: skip
        check(Drifting(2, 0.01), barrier)
    check(Drifting(2, 0.0), barrier)
    check(Drifting(2, 0.01, vouched=True), barrier)


def test_a_filter_of_a_long_period_is_built_from_as_many_phases_as_of_a_short_one():
    counts = {}
    for period in (200, 5000):
        seen = []

        def h(k, x, period=period, seen=seen):
            seen.append(k)
            return 1.0 + 0.1 * np.sin(2 * np.pi * k / period) - x[0]

        BarrierFilter(CART, [Barrier("b", h, period, [0.5, 0.5])])
        counts[period] = len(seen)
    assert counts[5000] < 3 * counts[200]
