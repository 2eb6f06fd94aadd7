"""What a user writes about the periodic MPC (36)."""

from __future__ import annotations

import math
from typing import Annotated, Final, Literal

from pydantic import Field, model_validator

from pdhocbf_drake.config import Config, Length, within

_LARGEST_VARIANCE = 1e6  # [m²] or [m²/s²]

Tail = Literal["periodic", "truncated", "anticipative"]
Price = Annotated[float, within(0.0, 1e12, "", above=True)]
Speed = Annotated[float, within(0.0, 1e3, "m/s", above=True)]
Rate = Annotated[float, within(0.0, 1e3, "m/s")]
Shift = Annotated[float, within(0.0, 10.0, "m")]
Room = Annotated[float, within(-10.0, 10.0, "m")]
Delay = Annotated[int, within(0, 1000, "ticks")]

SENSING: Final = frozenset({"delay", "zmp_lag", "filter", "disturbance"})
"""Keys of `MpcConfig` about what is measured and sent, which no program depends on."""


class PlanLimits(Config):
    """What the joints of a robot leave to the plan.

    Attributes:
        zmp_behind, zmp_ahead: how far behind and ahead of the sole's centre the ZMP of all links may lie, for the
            torque of the ankle's pitch joint; a negative one keeps it on the other side [m].
        zmp_inward, zmp_outward: likewise towards the other foot and away from it, for that of its roll joint [m].
        step_reach: farthest that a foothold may lie from the stance foot in x and y, for the legs' length and the
            speed of the swinging leg's joints [m].
        stride: longest stride that is granted to a commanded walk; null is as far as the legs reach [m].
        zmp_middle: how far ahead of the sole's centre and outward of it the middle of the ZMP box lies, for the torques
            of knees, hips and ankles [m].
        zmp_held: from and to where, ahead of the sole's centre, hip and knee of a leg that stands alone hold the ZMP of
            all links in a disturbed walk, at each tick of a step; such a walk has its box in the sole's middle then.
            Empty where they hold it anywhere [m].
        swing_acceleration: as `mpc.swing_acceleration`, in a disturbed walk, for the torque of the swinging leg's hip
            [m/s²]; null leaves that to `mpc.recovery.swing_acceleration`.
    """

    zmp_behind: Room
    zmp_ahead: Room
    zmp_inward: Room
    zmp_outward: Room
    step_reach: tuple[Length, Length]
    stride: Shift | None = None
    zmp_middle: tuple[Room, Room] = (0.0, 0.0)
    zmp_held: tuple[tuple[Room, Room], ...] = ()
    swing_acceleration: float | None = Field(None, gt=0)

    @model_validator(mode="after")
    def _leave_room(self) -> PlanLimits:
        for low, high in (("zmp_behind", "zmp_ahead"), ("zmp_inward", "zmp_outward")):
            if (room := getattr(self, low) + getattr(self, high)) <= 0.0:
                raise ValueError(f"{low} and {high} must be more than 0 m together, or no ZMP is allowed: {room:g} m")
        if wrong := [pair for pair in self.zmp_held if pair[0] > pair[1]]:
            raise ValueError(f"each entry of zmp_held must be [from, to] with from <= to (given: {list(wrong[0])})")
        return self


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
    slack_weight: tuple[Price, Price] = (10.0, 100.0)
    freeze_ticks: int = Field(6, ge=0)


Box = tuple[Shift, Rate]
"""Half-widths of what a tick may add to the CoM and to its velocity [m, m/s]."""


class AxisBoxes(Config):
    """Boxes of what a tick may add, of each axis by itself.

    Attributes:
        x, y: one box for all ticks, or one for each tick of a step.
    """

    x: tuple[Box, ...] = Field(min_length=1)
    y: tuple[Box, ...] = Field(min_length=1)


class RobustConfig(Config):
    """What the true state may differ by from the one that is planned from, see docs/robust.md.

    Attributes:
        disturbance: the most that a tick may add to the CoM and to its velocity, along x and y [m, m/s]; or
            {x: [...], y: [...]}, a list of these for each axis, with one entry or with one for each tick of a step.
        estimate: of the error of the measured CoM and velocity along each axis: standard deviations [m, m/s], or their
            covariance [[m², m²/s], [m²/s, m²/s²]].
        sigmas: how many of these the error stays below.
        innovations: whether `disturbance` is the most that a measured state differs by from the prediction of it a tick
            before, with all that errors of the measurement add; `pdhocbf design-bound --confidence` finds such ones.
    """

    disturbance: Box | AxisBoxes = (0.0, 0.0)
    estimate: tuple[Shift, Rate] | tuple[tuple[float, float], tuple[float, float]] = (0.0, 0.0)
    sigmas: Annotated[float, within(0.0, 10.0, "")] = 3.0
    innovations: bool = False

    @model_validator(mode="after")
    def _is_covariance(self) -> RobustConfig:
        com, velocity = self.estimate
        if isinstance(com, tuple) and isinstance(velocity, tuple):
            same = com[1] == velocity[0] and min(com[0], velocity[1]) >= 0.0
            if not same or com[0] * velocity[1] < com[1] ** 2 or max(com[0], velocity[1]) > _LARGEST_VARIANCE:
                raise ValueError(
                    "a covariance is symmetric, has no direction of negative variance, and variances up to "
                    f"{_LARGEST_VARIANCE:g} (given {[list(com), list(velocity)]})"
                )
        return self

    def boxes(self, axis: int) -> tuple[Box, ...]:
        """What a tick may add along an axis (0 or 1): one box for all ticks, or one for each tick of a step."""
        given = self.disturbance
        return ((given.x, given.y)[axis]) if isinstance(given, AxisBoxes) else (given,)

    @property
    def errors(self) -> tuple[float, float]:
        """The box of the estimate's error, which holds that many standard deviations [m, m/s]."""
        com, velocity = self.estimate
        if isinstance(com, tuple) and isinstance(velocity, tuple):
            com, velocity = math.sqrt(com[0]), math.sqrt(velocity[1])
        return self.sigmas * float(com), self.sigmas * float(velocity)  # type: ignore[arg-type]


class FilterConfig(Config):
    """What is known of the measured CoM, from which the gain of a Kalman filter follows.

    Attributes:
        com: standard deviation of the noise of the measured CoM, the same in x and y [m].
        velocity: likewise of the CoM velocity [m/s].
        model: standard deviation of the acceleration that the template does not model [m/s²].
        push: likewise while a push is noticed [m/s²].
    """

    com: Annotated[float, within(0.0, 1.0, "m")] = 0.0
    velocity: Annotated[float, within(0.0, 10.0, "m/s")] = 0.0
    model: Annotated[float, within(0.0, 100.0, "m/s²", above=True)] = 0.3
    push: Annotated[float, within(0.0, 1000.0, "m/s²", above=True)] = 5.0


WIDE_BAND, NARROW_BAND = 0.05, 0.02
"""`band` of "auto" [m/s²]; the gait itself makes the estimate swing by ±0.03, which the wide one leaves alone."""


class DisturbanceConfig(Config):
    """How a constant disturbance, such as wind, a slope or a load, is estimated and cancelled.

    Attributes:
        gain: share of the acceleration that a tick was wrong by which the estimate takes over [1].
        most: largest estimate, horizontally [m/s²].
        rate: fastest change of the estimate, which keeps it from following a push [m/s³].
        band: what is cancelled stays as it is while it is this close to the estimate [m/s²]; "auto" is 0.05, and 0.02
            where encoders are off by more than 2 mrad, which tilts what is believed of the robot.
    """

    gain: Annotated[float, within(0.0, 1.0, "", above=True)] = 0.02
    most: Annotated[float, within(0.0, 5.0, "m/s²", above=True)] = 0.6
    rate: Annotated[float, within(0.0, 1000.0, "m/s³", above=True)] = 0.8
    band: Annotated[float, within(0.0, 5.0, "m/s²")] | Literal["auto"] = "auto"

    @property
    def width(self) -> float:
        """`band`, or where no scenario says it the wide one [m/s²]."""
        return WIDE_BAND if self.band == "auto" else self.band


class MpcConfig(Config):
    """The periodic MPC.

    Attributes:
        horizon: H [ticks], a multiple of the gait (Lemma 2).
        tail: what the ZMP is taken to do after the horizon, eq. (32); the standing start is always
            anticipative, since it does not repeat.
        foothold_weight: ε of eq. (36), one squared distance per foothold [1/s²].
        zmp_centre_weight: price of the ZMP's squared distance from the centre of its box [1/s²]; not in eq. (36).
        sway_weight: the same in y alone, which keeps the sway in the middle between the feet, but not while a
            disturbed walk recovers; null is `zmp_centre_weight` [1/s²].
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
        robust: what barriers and ZMP box are tightened for, so that the true state keeps them; null tightens nothing.
        solver: "daqp" (active set, compiled) or "clarabel" (Drake's, interior point).
        delay: how late measurements are [ticks]; what is measured is carried forward by the ZMP velocities sent since.
            "auto" takes what `measurement` has.
        zmp_lag: rate λ at which the robot's ZMP follows the one that is sent, ṗ = λ (p_sent − p) [1/s]; what is sent
            leads the planned ZMP by as much. null is for one that follows at once.
        filter: noise of the measured CoM, which is filtered with the template as model; "auto" takes what
            `measurement` has, null filters nothing.
        disturbance: a constant disturbance is estimated and cancelled; null cancels nothing.
    """

    horizon: int = Field(80, ge=1, le=20_000)
    tail: Tail = "periodic"
    foothold_weight: Price = 1e5
    zmp_centre_weight: float = Field(0.0, ge=0, le=1e12)
    sway_weight: float | None = Field(None, ge=0, le=1e12)
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
    robust: RobustConfig | None = None
    solver: Literal["daqp", "clarabel"] = "daqp"
    delay: Delay | Literal["auto"] = "auto"
    zmp_lag: Annotated[float, within(0.0, 1e4, "1/s", above=True)] | None = None
    filter: FilterConfig | Literal["auto"] | None = "auto"
    disturbance: DisturbanceConfig | None = None

    @property
    def delay_ticks(self) -> int:
        """How late measurements are; 0 where no scenario says it [ticks]."""
        return 0 if self.delay == "auto" else self.delay

    @property
    def noise(self) -> FilterConfig | None:
        """What is filtered; None where there is nothing, or where no scenario says it."""
        noise = self.filter
        return noise if isinstance(noise, FilterConfig) and (noise.com or noise.velocity) else None

    @property
    def holds_zmp(self) -> bool:
        """Whether hip and knee limit the ZMP, as they do in a disturbed walk, whose tail is paid for."""
        return self.stability == "paid" and self.plan_limits is not None and bool(self.plan_limits.zmp_held)

    @property
    def plan_limits(self) -> PlanLimits | None:
        """`limits`, where they are numbers."""
        return self.limits if isinstance(self.limits, PlanLimits) else None
