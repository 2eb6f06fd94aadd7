"""Noise is the same number for all that read it at an instant, whichever kind of event they read it in."""

from __future__ import annotations

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.primitives import LogVectorOutput, VectorLogSink, ZeroOrderHold

from pdhocbf_drake.simulation.noise import add_noise
from pdhocbf_drake.simulation.wiring import Wiring

TIME, SAMPLES = 0.01, 400


def _logs(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Noise as a log's publish events read it, and as an update of the same instants reads it."""
    wiring = Wiring(TIME)
    noise = add_noise(wiring, "noise", 2, TIME, seed)
    update = wiring.builder.AddSystem(ZeroOrderHold(TIME, 2))
    wiring.builder.Connect(noise, update.get_input_port())
    logs: list[VectorLogSink] = [
        LogVectorOutput(port, wiring.builder, TIME) for port in (noise, update.get_output_port())
    ]
    simulator = Simulator(wiring.builder.Build())
    for adjust in wiring.adjust:
        adjust(simulator.get_mutable_context())
    simulator.AdvanceTo(SAMPLES * TIME)
    published, updated = (log.FindLog(simulator.get_context()).data().T for log in logs)
    return published[:-1], updated[1:]


def test_a_log_has_what_an_update_of_the_same_instant_reads():
    published, updated = _logs(seed=3)
    np.testing.assert_array_equal(published, updated)


def test_it_is_white_and_standard_normal_from_the_first_number_on():
    (first, _), (again, _), (other, _) = _logs(seed=3), _logs(seed=3), _logs(seed=4)
    np.testing.assert_array_equal(first, again)
    assert not (first == other).any() and first[0].all()
    assert len(np.unique(first)) == first.size
    np.testing.assert_allclose(first.mean(axis=0), 0.0, atol=4.0 / np.sqrt(SAMPLES))
    np.testing.assert_allclose(first.std(axis=0), 1.0, atol=4.0 / np.sqrt(2 * SAMPLES))
    follows = (first[1:] * first[:-1]).mean(axis=0)
    np.testing.assert_allclose(follows, 0.0, atol=4.0 / np.sqrt(SAMPLES))
