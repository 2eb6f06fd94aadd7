"""How a disturbed walk is planned: what is allowed then, and when it begins and ends."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.gait import Gait
from pdhocbf_drake.mpc.config import MpcConfig, RecoveryConfig
from pdhocbf_drake.templates.divergent import DivergentComponent
from pdhocbf_drake.templates.vhip import Vhip


def recovery_of(gait: Gait, vhip: Vhip, config: MpcConfig) -> tuple[Gait, Vhip, MpcConfig]:
    """The gait, template and MPC of a disturbed walk, as `RecoveryConfig` describes it."""
    recovery = config.recovery or RecoveryConfig()
    box = recovery.zmp_box or gait.config.zmp_box
    changed = {
        "recovery": None,
        "barrier": "soft",
        "tail": "anticipative",
        "stability": "paid",
        "terminal_set": None,
        "tail_weight": recovery.tail_weight,
        "foothold_weight": recovery.foothold_weight,
        "step_reach": recovery.step_reach,
        "stance_width_min": recovery.stance_width_min,
        "freeze_ticks": recovery.freeze_ticks,
        "slack_weight": recovery.slack_weight,
        "path_correction": recovery.path_correction,
        "swing_acceleration": recovery.swing_acceleration,
    }
    return Gait(gait.config.model_copy(update={"zmp_box": box})), vhip, config.model_copy(update=changed)


class Disturbance(NamedTuple):
    """Whether a walk is disturbed, and what that is told by.

    Attributes:
        astray: sum of the divergent component's prediction errors, forgotten within about a step, shape (2,) [m].
        active: whether the walk is being recovered.
        quiet: ticks since the last sign of trouble.
    """

    astray: np.ndarray
    active: bool
    quiet: int

    def after(self, config: RecoveryConfig, period: int, error: np.ndarray, moved: float) -> Disturbance:
        """One tick later.

        Args:
            config: what is noticed. period: N [ticks].
            error: measured minus predicted divergent component, shape (2,) [m].
            moved: how far the last plan's next foothold is from the commanded one [m].
        """
        astray = (1.0 - 2.0 / period) * self.astray + error
        trouble = bool(np.abs(astray).max() > config.noticed)
        if not self.active:
            return Disturbance(astray, trouble, 0)
        quiet = 0 if trouble or moved > config.calm else self.quiet + 1
        return Disturbance(astray, quiet < config.calm_ticks, quiet)


CALM = Disturbance(np.zeros(2), False, 0)


def divergent_error(
    divergent: DivergentComponent, tick: int, measured: np.ndarray, predicted: np.ndarray
) -> np.ndarray:
    """Measured minus predicted ξ = c + v/ω for [c, v, p] per axis, shape (2,) [m]."""
    return np.asarray((measured - predicted)[:, :2] @ divergent.offset_row(tick)[:2])
