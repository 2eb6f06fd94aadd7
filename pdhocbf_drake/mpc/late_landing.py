"""The ZMP box of a step whose foot comes to the ground late."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.walking.frame import rotation


def expected(
    mpc: PeriodicMpc, tick: int, stance: np.ndarray, late: float, offset: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """The ZMP offset at k + 1 … k + H of a step whose foot comes late, and the way by which its box is behind at k + 1.

    The box moves from the last foot to this one as many ticks later as this one has come to the ground late. At tick q
    of this step it is behind by (w_q − w_{q−late}) (centre_j − centre_{j−1}), see `walking.support`. The swing of the
    other foot waits as long, so that no leg is expected to move the ZMP until then. Shapes (2, H) and (2,) [m].

    Args:
        tick: k. stance: centres of the last and of this step's box per axis, shape (2, 2) [m].
        late: [ticks]. offset: of a step whose foot comes down in time, shape (2, H) [m]; None is zero.
    """
    _, phase = mpc.gait.phase(tick)
    ticks = np.arange(phase + 1, mpc.gait.period)
    due, share = mpc.gait.region.share(ticks), mpc.gait.region.share(ticks - late)
    found = np.zeros((2, mpc.config.horizon)) if offset is None else offset.copy()
    found[:, : len(ticks)] *= ticks > mpc.gait.config.double_support_ticks + late
    behind = np.outer(stance[:, 1] - stance[:, 0], due - share)
    found[:, : len(ticks)] += behind
    return found, behind[:, 0] if len(ticks) else np.zeros(2)


def moved_back(mpc: PeriodicMpc, tick: int, box: np.ndarray, behind: np.ndarray) -> np.ndarray:
    """`Memory.zmp_box` of tick k + 1, as far behind as it is then, (2,) [m]."""
    yaw = mpc.commanded.steps(tick // mpc.gait.period).yaw
    return box - np.repeat(rotation(-yaw) @ behind if yaw else behind, 2)
