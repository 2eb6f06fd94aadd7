"""What a user writes about the periodic MPC (36)."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from pdhocbf_drake.config import Config, Length, within

Tail = Literal["periodic", "truncated", "anticipative"]
Price = Annotated[float, within(0.0, 1e12, "", above=True)]
Speed = Annotated[float, within(0.0, 1e3, "m/s", above=True)]
Shift = Annotated[float, within(0.0, 10.0, "m")]
Room = Annotated[float, within(-10.0, 10.0, "m")]


class PlanLimits(Config):
    """What the joints of a robot leave to the plan.

    Attributes:
        zmp_behind, zmp_ahead: how far behind and ahead of the sole's centre the ZMP of all links may lie, for the
            torque of the ankle's pitch joint; a negative one keeps it on the other side [m].
        zmp_inward, zmp_outward: likewise towards the other foot and away from it, for that of its roll joint [m].
        step_reach: farthest that a foothold may lie from the stance foot in x and y, for the legs' length and the
            speed of the swinging leg's joints [m].
        stride: longest stride that is granted to a commanded walk; null is as far as the legs reach [m].
    """

    zmp_behind: Room
    zmp_ahead: Room
    zmp_inward: Room
    zmp_outward: Room
    step_reach: tuple[Length, Length]
    stride: Shift | None = None


class RecoveryConfig(Config):
    """How a disturbed walk is planned, and what counts as disturbed.

    While it lasts, the ZMP may use the sole's own box, footholds may lie anywhere within reach, the tail follows the
    coming footholds (anticipative) and is paid for instead of demanded.

    Attributes:
        noticed: prediction errors of the divergent component that add up to this within a step are a disturbance [m].
        calm: it is over when the steady program has a plan whose next foothold is this close to the commanded one [m].
        calm_ticks: how long nothing must have been noticed before that is tried [ticks].
        foothold_weight: ε of eq. (36) [1/s²].
        tail_weight: price of a missed tail, squared [1/s²].
        zmp_box: side lengths of the ZMP box in x and y; null keeps the gait's [m].
        step_reach: farthest that a foothold may lie from the stance foot in x and y [m].
        stance_width_min: least lateral distance of a foothold from the stance foot, so that the legs never cross [m].
        path_correction: how much of the distance from the commanded path one step may ask back, x and y [m].
        swing_acceleration: as `mpc.swing_acceleration` [m/s²].
        slack_weight: price of each barrier row's slack, linear [m/s] and quadratic [1]: low, since a robot that is to
            stay on its feet must be allowed to be fast for a step.
        freeze_ticks: as `mpc.freeze_ticks`, but later, since a late push must still move the foot [ticks].
    """

    noticed: float = Field(0.015, gt=0)
    calm: float = Field(0.03, gt=0)
    calm_ticks: int = Field(40, ge=1)
    foothold_weight: Price = 1e3
    tail_weight: Price = 1e8
    zmp_box: tuple[Length, Length] | None = None
    step_reach: tuple[Length, Length] = (0.45, 0.5)
    stance_width_min: Shift = 0.145
    path_correction: tuple[Shift, Shift] = (0.02, 0.02)
    swing_acceleration: float = Field(60.0, gt=0)
    slack_weight: tuple[Price, Price] = (1e2, 1e3)
    freeze_ticks: int = Field(6, ge=0)


class MpcConfig(Config):
    """The periodic MPC.

    Attributes:
        horizon: H [ticks], a multiple of the gait (Lemma 2).
        tail: what the ZMP is taken to do after the horizon, eq. (32); the standing start is always
            anticipative, since it does not repeat.
        foothold_weight: ε of eq. (36), one squared distance per foothold [1/s²].
        zmp_centre_weight: price of the ZMP's squared distance from the centre of its box [1/s²]; not in eq. (36).
        path_correction: how much of the feet's distance from the commanded path one step may ask back, x and y [m].
        step_tolerance: how far a foothold may move from the commanded step, in x and y [m].
        stance_width_min: least lateral distance of a foothold from the stance foot [m].
        barrier: "soft" pays for a violated barrier row, "hard" forbids it.
        slack_weight: price of each barrier row's slack: linear [m/s] and quadratic [1]. A linear price above the
            row's multiplier is exact: slack is used only where the barrier can't be kept.
        zmp_margin: how far inside the ZMP box of the gait the ZMP is planned to stay [m].
        zmp_velocity_max: largest speed of the ZMP in x and y; null leaves it free. The moving box demands some [m/s].
        freeze_ticks: a coming foothold no longer moves this long before it is reached [ticks].
        stop_ticks: ticks in a row without a solution or a measurement after which the walk comes to a stand.
        zmp_state: "planned" takes the ZMP of the last plan as the ZMP now; "measured" is Remark 8 to the letter.
        terminal_set: a file that `pdhocbf certify` wrote: the plan must end in that set, eq. (20f), and the tail's
            stability condition is paid for instead of demanded; null demands the latter. With a hard barrier it must be
            the set that was certified for that barrier's rows.
        stability: whether the stability row is demanded, or a missed tail is paid for.
        tail_weight: price of a tail that is missed, squared, where it is paid for or there is a terminal set [1/s²].
        step_reach: farthest that a foothold may lie from the stance foot in x and y, in place of `step_tolerance` [m].
        swing_acceleration: limits how far the landing of a swinging foot may still be moved: by a/10 times the square
            of the time left before it is frozen [m/s²]; null leaves that free.
        limits: what the robot's joints leave to the plan, in a disturbed walk too; "model" computes it from the robot's
            model when the walk is built, null leaves the joints' limits to the motors.
        recovery: how a disturbed walk is planned; null plans it like any other.
        solver: "daqp" (active set, compiled) or "clarabel" (Drake's, interior point).
    """

    horizon: int = Field(80, ge=1, le=20_000)
    tail: Tail = "periodic"
    foothold_weight: Price = 1e5
    zmp_centre_weight: float = Field(0.0, ge=0, le=1e12)
    path_correction: tuple[Shift, Shift] = (0.02, 0.05)
    step_tolerance: tuple[Shift, Shift] = (0.1, 0.05)
    stance_width_min: Shift = 0.12
    barrier: Literal["soft", "hard"] = "soft"
    slack_weight: tuple[Price, Price] = (1e5, 1e6)
    zmp_margin: Shift = 0.0
    zmp_velocity_max: tuple[Speed, Speed] | None = None
    freeze_ticks: int = Field(8, ge=0)
    stop_ticks: int = Field(20, ge=1)
    zmp_state: Literal["planned", "measured"] = "planned"
    terminal_set: str | None = None
    stability: Literal["demanded", "paid"] = "demanded"
    step_reach: tuple[Length, Length] | None = None
    swing_acceleration: float | None = Field(None, gt=0)
    limits: PlanLimits | Literal["model"] | None = "model"
    recovery: RecoveryConfig | None = None
    tail_weight: Price = 1e6
    solver: Literal["daqp", "clarabel"] = "daqp"

    @property
    def plan_limits(self) -> PlanLimits | None:
        """`limits`, where they are numbers."""
        return self.limits if isinstance(self.limits, PlanLimits) else None
