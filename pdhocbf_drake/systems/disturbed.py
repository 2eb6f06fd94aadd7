"""Whether a walk is disturbed, as blocks read it that learn from an undisturbed one."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.systems.signals import places

_DISTURBED = (Reason.RECOVERING, Reason.NO_STEADY_PLAN)
(_REASON,) = places("solver_status", "reason")


def is_disturbed(status: np.ndarray) -> bool:
    """Whether the plan of a solver_status (6,) is that of a disturbed walk."""
    return float(status[_REASON]) in _DISTURBED
