"""How late the measurements of a recorded walk are, and how its ZMP lags behind what was sent.

The template says how the velocity changes in a tick. A measurement that is late by d ticks is of a state that the ZMP
of d ticks ago acted on:

    e_d(k) = v(k + 1) − v(k) − δ eta(k − d) (c(k) − p(k − d)),   v and c as measured, p as sent

d is the number of ticks with the smallest spread of e_d; its mean, a constant disturbance, does not count.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.commands import commanded_gait
from pdhocbf_drake.simulation.run_folder import Run

MOST: Final = 12
"""The longest delay that is tried [ticks]."""
LAGS: Final = (5.0, 7.0, 10.0, 14.0, 20.0, 28.0, 40.0, 57.0, 80.0)
"""Rates of a lag that are tried [1/s]; a faster one can't be told from none."""
_BETTER = 0.8  # share of the spread without a lag, below which one is believed


class Late(NamedTuple):
    """What a log says.

    Attributes:
        delay: d [ticks].
        spreads: standard deviation of e_d for d = 0 … MOST [m/s].
        agree, gaits: how many gaits say the same each by itself, of how many.
        zmp_lag: λ [1/s]; None where no lag explains the log clearly better.
    """

    delay: int
    spreads: np.ndarray
    agree: int
    gaits: int
    zmp_lag: float | None


def late(run: Run) -> Late:
    """Delay and lag of a run, from what its controller got and what it sent.

    Raises:
        InputError: the run is no walk, or has less than two gaits after its `from_time`.
    """
    log, scenario = run.log, run.scenario
    if "lip_state" not in log or "zmp_reference" not in log:
        raise InputError(f"only the log of a walk says how late its measurements are; {scenario.name} is none")
    gait, eta = scenario.gait, commanded_gait(scenario).height.eta()
    first = max(int(np.searchsorted(log.time, scenario.from_time)), MOST + 1)
    count = (len(log) - 1 - first) // gait.ticks_per_gait
    if count < 2:
        raise InputError(
            f"two gaits of {gait.ticks_per_gait * gait.tick:g} s after {scenario.from_time:g} s are needed to say how "
            f"late measurements are (the log ends at {log.time[-1]:g} s)"
        )
    measured = log["measured_state" if "measured_state" in log else "lip_state"].reshape(-1, 2, 3)
    phase, sent = np.round(log.element("gait_phase", "tick")).astype(int), log["zmp_reference"][:, ::2]
    rows = first + np.arange(count * gait.ticks_per_gait)

    def errors(zmp: np.ndarray) -> np.ndarray:
        """e_d of both axes, each gait's mean taken off, (MOST + 1, gaits, ticks of a gait, 2)."""
        change = measured[rows + 1, :, 1] - measured[rows, :, 1]
        found = []
        for d in range(MOST + 1):
            pull = eta[phase[rows - d] % len(eta)][:, None] * (measured[rows, :, 0] - zmp[rows - d])
            each = (change - gait.tick * pull).reshape(count, -1, 2)
            found.append(each - each.mean(axis=1, keepdims=True))
        return np.array(found)

    own = errors(sent)
    spreads = np.sqrt(np.mean(own**2, axis=(1, 2, 3)))
    delay, lag, least = int(spreads.argmin()), None, _BETTER * spreads.min()
    for rate in LAGS:
        with_lag = np.sqrt(np.mean(errors(lagging(sent, rate * gait.tick)) ** 2, axis=(1, 2, 3)))
        if with_lag.min() < least:
            delay, lag, least, spreads = int(with_lag.argmin()), rate, float(with_lag.min()), with_lag
    alone = np.mean((own if lag is None else errors(lagging(sent, lag * gait.tick))) ** 2, axis=(2, 3)).argmin(axis=0)
    return Late(delay, spreads, int((alone == delay).sum()), count, lag)


def lagging(sent: np.ndarray, rate: float) -> np.ndarray:
    """A ZMP that follows what is `sent`, (T, 2), at a rate λδ: p(k + 1) = p(k) + (1 − e^{−λδ}) (sent(k + 1) − p(k))."""
    zmp, share = np.array(sent), 1.0 - np.exp(-rate)
    for k in range(1, len(zmp)):
        zmp[k] = zmp[k - 1] + share * (sent[k] - zmp[k - 1])
    return zmp
