"""What the joints' PD is predicted to add to a planned torque, from what it has added."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.whole_body.kernels import JOINTS, learn
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
