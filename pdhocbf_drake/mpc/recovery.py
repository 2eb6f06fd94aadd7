"""How a disturbed walk is planned: what is allowed then, and when it begins and ends."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.mpc.config import MpcConfig, RecoveryConfig
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.divergent import DivergentComponent
from pdhocbf_drake.walking.vhip import Vhip


def recovery_of(gait: Gait, vhip: Vhip, config: MpcConfig) -> tuple[Gait, Vhip, MpcConfig]:
    """The gait, template and MPC of a disturbed walk, as `RecoveryConfig` describes it."""
    recovery = config.recovery or RecoveryConfig()
    box = recovery.zmp_box or gait.config.zmp_box
    changed: dict[str, object] = {
        "recovery": None,
        "barrier": "soft",
        "tail": "anticipative",
        "stability": "paid",
        "terminal_set": None,
        "tail_weight": recovery.tail_weight,
        "foothold_weight": recovery.foothold_weight,
        "sway_weight": None,
        "step_reach": recovery.step_reach,
        "stance_width_min": recovery.stance_width_min,
        "freeze_ticks": recovery.freeze_ticks,
        "slack_weight": recovery.slack_weight,
        "path_correction": recovery.path_correction,
        "swing_acceleration": recovery.swing_acceleration,
    }
    if (limits := config.plan_limits) is not None:
        if limits.zmp_held:
            changed["limits"] = limits.model_copy(update={"zmp_middle": (0.0, limits.zmp_middle[1])})
        if limits.swing_acceleration is not None:
            changed["swing_acceleration"] = min(recovery.swing_acceleration, limits.swing_acceleration)
    return gait.with_box(box), vhip, config.model_copy(update=changed)


class Disturbance(NamedTuple):
    """Whether a walk is disturbed, and the evidence for it.

    Attributes:
        error_sum: sum of the divergent component's prediction errors in x and y, forgotten within about a step [m].
        active: whether the walk is being recovered.
        quiet: ticks since prediction errors last added up to a disturbance.
    """

    error_sum: tuple[float, float]
    active: bool
    quiet: int

    def after(self, config: RecoveryConfig, period: int, error: tuple[float, float]) -> Disturbance:
        """One tick later.

        Args:
            config: what counts as a disturbance.
            period: N [ticks].
            error: measured minus predicted divergent component in x and y [m].
        """
        kept = 1.0 - 2.0 / period
        error_sum = (kept * self.error_sum[0] + error[0], kept * self.error_sum[1] + error[1])
        trouble = abs(error_sum[0]) > config.noticed or abs(error_sum[1]) > config.noticed
        active = self.active or trouble
        return Disturbance(error_sum, active, self.quiet + 1 if active and not trouble else 0)

    def may_be_over(self, config: RecoveryConfig) -> bool:
        """Whether a walk that is recovered has been quiet for long enough to be planned as a steady one."""
        return self.active and self.quiet >= config.calm_ticks

    def ended(self) -> Disturbance:
        """The same, no longer active."""
        return Disturbance(self.error_sum, False, 0)


CALM = Disturbance((0.0, 0.0), False, 0)


def divergent_error(
    divergent: DivergentComponent, tick: int, measured: np.ndarray, predicted: np.ndarray
) -> tuple[float, float]:
    """Measured minus predicted ξ = c + v/ω for [c, v, p] per axis [m]."""
    omega = float(divergent.omega[tick % divergent.period])
    (x, vx, _), (y, vy, _) = measured.tolist()
    (x_plan, vx_plan, _), (y_plan, vy_plan, _) = predicted.tolist()
    return x - x_plan + (vx - vx_plan) / omega, y - y_plan + (vy - vy_plan) / omega
