"""A constant disturbance of the template, one acceleration w, estimated from velocity errors and cancelled.

    c̈ = eta (c − p_sent) + w,   p_sent = p + w/eta   ⇒   c̈ = eta (c − p)

Wind, a slope, a load or a CoM that is not where the model has it all look like it. Put into the prediction alone it
does not help: the plan restarts from what is measured, so that the commanded acceleration moves with it. What is sent
takes it off instead, and the ZMP box is met by p_sent. A ZMP that lags behind what is sent is led by as much likewise:

    ṗ = λ (p_sent − p)   ⇒   p_sent(k + 1) = p(k) + (p(k + 1) − p(k)) / (1 − e^{−λδ})
"""

from __future__ import annotations

import math

import numpy as np

from pdhocbf_drake.mpc.config import DisturbanceConfig
from pdhocbf_drake.mpc.kernels import write_disturbance

_YOUNG = 2  # [ticks]
# While a walk is recovered: the share of the gain, without which a steady wind could keep it so for ever; and by how
# much the band is wider, more than what a push adds to the estimate.
_SLOWER, _WIDER = 0.25, 2.5


def estimated(
    config: DisturbanceConfig, tick: float, age: int, w: np.ndarray, error: tuple[float, float],
    acted: np.ndarray, disturbed: bool = False,
) -> np.ndarray:  # fmt: skip
    """Estimate and what of it is cancelled, one tick later: w_x, w_y, cancelled x, y (4,) [m/s²].

        w ← w + g (error/δ + acted − w),   no faster than `rate` and no larger than `most`
        cancelled ← the nearest to it that is within `band` of w; where w itself is that small, g of it is forgotten

    The robot's own motion repeats every gait, and so does what the template does not model of it: a w that swings by
    less than `band` changes nothing that is sent. In its first ticks g is that of a mean, 1/(age + 2), since a walk
    that begins has no other estimate; while a push is recovered from it is smaller and the band is wider, since much
    else is wrong then. All limits are on lengths: the same in every yawed frame. An error that is not finite changes
    nothing.

    Args:
        tick: δ [s].
        age: ticks since the walk began.
        w: estimate and what is cancelled so far (4,) [m/s²].
        error: believed minus predicted velocity, in x and y [m/s].
        acted: what was cancelled in the tick that the error is of (2,) [m/s²]; with what is cancelled by now instead, a
            late measurement would feed the estimate back to itself.
        disturbed: whether the walk is being recovered.
    """
    slower, wider = (_SLOWER, _WIDER) if disturbed else (1.0, 1.0)
    gain = max(config.gain * slower, 1.0 / (age + _YOUNG))
    after = np.empty(4)
    write_disturbance(
        gain, config.rate * tick * gain / config.gain, config.most, wider * config.width, tick, w, error, acted, after
    )
    return after


def lead(zmp_lag: float | None, tick: float) -> float:
    """By how many ticks' way of the planned ZMP what is sent leads it: 1/(1 − e^{−λδ}) − 1 [1]."""
    return 0.0 if zmp_lag is None else 1.0 / math.expm1(zmp_lag * tick)
