"""Why a plan of the periodic MPC may be less than an optimum, and the constraints that it may miss."""

from __future__ import annotations

from enum import IntEnum

NOTICED = 1e-6  # [m/s] or [m]: a constraint that is missed by less counts as met

CONSTRAINTS = ("stability", "zmp_box", "step")
"""The constraints of an axis besides its barriers; a terminal set stands in the place of the stability row."""


class Reason(IntEnum):
    """Why a tick's plan is what it is; logged as the last entry of `solver_status`."""

    SOLVED = 0
    SOFTENED = 1  # a barrier row can't be met: its slack is paid for
    CROSS_SOLVED = 2  # the first solver stopped without an answer, the second one gave it
    RELAXED = 3  # "stability" can't be met: the tail is missed by as little as possible, and gamma is 1
    INFEASIBLE = 4  # limits of "zmp_box" or "step" contradict each other: the last plan, shifted by a tick
    NOT_OPTIMAL = 5  # no solver gave an answer: the last plan, shifted by a tick
    BAD_MEASUREMENT = 6  # the measured state is not finite: planned from the predicted one
    STALE_MEASUREMENT = 7  # the measured state repeats while the robot should move: likewise
    STOPPING = 8  # degraded for too long: the walk comes to a stand
    RECOVERING = 9  # a disturbance was noticed: planned with the footholds, box and tail of `RecoveryConfig`
    NO_STEADY_PLAN = 10  # nothing was noticed, but the steady walk's program has no solution: planned likewise

    @property
    def planned(self) -> bool:
        """Whether the tick's plan is the answer of a solver."""
        return self not in (Reason.INFEASIBLE, Reason.NOT_OPTIMAL)
