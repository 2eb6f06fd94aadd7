"""The plan of a walk on sensors where the robot truly stands."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.analysis.heading import along, box_frame
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.systems.signals import places

Array = NDArray[np.float64]

_FEET: Final = [places("foot_state", f"{side}_x", f"{side}_y") for side in ("left", "right")]
_HELD: Final = places("estimator_status", "held")[0]
_PLANNED: Final = {
    "com_reference": [("x", "y")],
    "zmp_reference": [("x_zmp", "y_zmp")],
    "stance_plan": [(f"x_{which}", f"y_{which}") for which in ("last", "now", "next", "after")],
    "foot_reference": [(f"{side}_x", f"{side}_y") for side in ("left", "right")],
}


def plan_over_stance(log: RunLog) -> RunLog:
    """A log whose planned places are moved by how far the stance foot truly is from where it is estimated.

    Where a robot stands in the world can't be observed, so the world of the estimate, in which the plan is made, drifts
    from the true one, in which the log has CoM, ZMP and feet. Both share the foot that stands. Other logs are given
    back as they are.
    """
    if "foot_estimate" not in log or log["estimator_status"].shape[1] <= _HELD:
        return log
    rows, held = np.arange(len(log)), (log["estimator_status"][:, _HELD] > 0.5).astype(int)
    apart = log["foot_state"] - log["foot_estimate"]
    shift = np.stack([apart[:, foot] for foot in _FEET], axis=1)[rows, held]
    signals = dict(log.signals)
    for name, pairs in _PLANNED.items():
        signals[name] = log[name].copy()
        for pair in pairs:
            signals[name][:, places(name, *pair)] += shift
    in_box = along(shift, box_frame(log)[:, 2]) if "path" in log else shift
    signals["zmp_box"] = log["zmp_box"] + np.repeat(in_box, 2, axis=1)
    return RunLog(signals, log.time, log.ending)


def present_over_stance(signals: dict[str, Array]) -> dict[str, Array]:
    """The same of the signals of one tick, each (size,)."""
    if "foot_estimate" not in signals:
        return signals
    log = plan_over_stance(RunLog({name: value[None] for name, value in signals.items()}, np.zeros(1)))
    return {name: table[0] for name, table in log.signals.items()}
