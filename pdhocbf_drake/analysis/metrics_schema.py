"""The schema of `metrics.json`, on which scripts may rely."""

from __future__ import annotations

from typing import Final

from pydantic import BaseModel, ConfigDict, Field

TORQUE_KEPT: Final = 0.005
"""Share of samples with a joint at its torque limit up to which a run counts as one that keeps its limits."""


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True)


class BarrierMetrics(_Table):
    """One barrier on the measured state, from `from_time` on."""

    h_min: float | None = Field(description="least h [unit]")
    h_mean: float | None = Field(description="safety margin, eq. (5) [unit]")
    violations: int | None = Field(description="ticks with h < −1e-9 of the bound's magnitude, or NaN")
    judged_ticks: int | None = Field(None, description="ticks that were judged; null for a whole gait or more")
    psi_min: float | None = Field(description="least ψ_m along the measured trajectory [unit]")
    slack_max: float | None = Field(description="largest slack of its rows in a plan [unit]")
    softened_ticks: int | None = Field(description="ticks, at any time, whose plan has such a slack")
    active_ticks: int | None = Field(None, description="ticks, at any time, whose plan a row of it changed")
    active_first: float | None = Field(None, description="time of the first such tick [s]")
    active_slower: float | None = Field(
        None,
        description="commanded speed of the walk less its mean speed, over the whole steps with such ticks, from the "
        "fifth step after the start and after a change of the command on [m/s]",
    )
    gamma: list[float] = Field(description="class-K slopes γ_1 … γ_m")
    relative_degree: int = Field(description="declared relative degree, in ticks")
    unit: str = Field(description="unit of h")


class GrantedCommand(_Table):
    """A command that was granted in part, ahead and aside [m/s] and as a turn rate [rad/s]."""

    time: float = Field(description="when it was taken up [s]")
    asked: tuple[float, float, float] = Field(description="what was asked for")
    granted: tuple[float, float, float] = Field(description="what was granted of it")


class MpcMetrics(_Table):
    """The solves of the controller; on the oscillator, of its barrier filter."""

    solves: int = Field(description="ticks with a solve")
    fallbacks: int = Field(description="ticks that used the last plan, shifted, instead of a new one")
    failures: int = Field(
        description="ticks at which the first solver found no optimum of the problem that the scenario states, "
        "any slack of a hard barrier included"
    )
    degraded: dict[str, int] = Field(description="ticks that were not simply solved, by reason (`mpc.plan.Reason`)")
    slack_max: float | None = Field(description="largest slack of any barrier row in a plan [its unit]")
    tick_seconds_median: float | None = Field(description="wall time of a tick's update [s]")
    tick_seconds_p99: float | None = Field(description="99th percentile of it [s]")
    solver: str = Field(description="the first solver of each tick")


class WholeBodyMetrics(_Table):
    """What became of the planned motion at the limits of joints and soles."""

    active_ticks: int = Field(description="ticks in which the closed form would have exceeded a limit")
    misses: dict[str, int] = Field(
        description="ticks in which one is missed all the same, by `whole_body.reason.Reason`"
    )


class BoundMetrics(_Table):
    """A bound that joints, legs or feet leave to the plan."""

    active_ticks: int = Field(description="ticks whose plan was at it")
    active_first: float | None = Field(None, description="time of the first such tick [s]")


class PieceMetrics(_Table):
    """A piece of uneven ground, by its number in the scenario, and how far the walk has come over it."""

    kind: str = Field(description="as in the scenario's `ground`")
    known: bool = Field(description="whether it is on the map")
    length: float = Field(description="along x [m]")
    walked: float = Field(description="of it, between the first and the last place where a foot stood [m]")
    rise: float | None = Field(None, description="of each stair, negative downwards [m]; null for what is no stairs")
    stairs: int | None = Field(None, description="their number")
    stairs_taken: int | None = Field(None, description="those whose edge lies between these places")


class EstimatorMetrics(_Table):
    """The estimate from the sensors beside the true state."""

    position_drift: float | None = Field(description="drift of the CoM over the way that it went; null without one")
    yaw_drift_deg_per_minute: float = Field(description="drift of the floating link's heading [deg/min]")
    velocity_rms: list[float] = Field(description="RMS error of the CoM's velocity in x and y [m/s]")
    height_rms: float = Field(description="RMS error of the CoM's height [m]")
    nees: float = Field(description="mean normalized square of the eight observable errors; 8 where it is consistent")
    nees_within: float = Field(description="share of gaits whose mean of it is below its 95 % limit, 15.5")
    contact_errors: float = Field(description="share of feet and ticks with load as estimated but no touch, or reverse")
    notices: dict[str, int] = Field(description="ticks at which sensors were found wrong, by `estimation.Notice`")


class Metrics(_Table):
    """The numbers of one run; null where a quantity does not apply."""

    schema_: int = Field(1, alias="schema", description="version of this table")
    scenario: str = Field(description="name of the scenario")
    robot: str | None = Field(None, description="name of the robot; null without one")
    template: bool = Field(description="true for a run without a robot's body")
    ending: str = Field(description='"finished", or why it ended early: "fell", "interrupted", …')
    fell: bool = Field(description="whether the robot fell")
    simulated_seconds: float = Field(description="[s]")
    wall_seconds: float = Field(description="[s]")
    real_time_factor: float | None = Field(description="simulated over wall time")
    steps_taken: int | None = Field(description="completed steps of one foot")
    position: list[float | None] | None = Field(None, description="CoM at the end in the world, x and y [m]")
    heading_deg: float | None = Field(None, description="heading of the robot at the end, turns counted [deg]")
    turn_rate: float | None = Field(None, description="mean turn rate of the robot from from_time on [rad/s]")
    distance: float | None = Field(
        description="CoM along the commanded heading, which is x without commands, end less start [m]"
    )
    distance_commanded: float | None = Field(
        description="distance of the commanded walk along its heading, (steps − ½)·stride straight ahead [m]"
    )
    mean_speed: float | None = Field(
        description="mean CoM velocity along the commanded heading from from_time on [m/s]"
    )
    lateral_drift: float | None = Field(
        description="|mean CoM of the last gait, across the commanded path, less that at the start|, once a whole gait "
        "was walked [m]"
    )
    left_path: bool | None = Field(
        None, description="whether the robot's lateral_drift is more than the width of its smaller sole"
    )
    path_error_max: float | None = Field(
        None, description="farthest that the CoM's mean over a gait was from that of the commanded path [m]"
    )
    command_error: list[float | None] | None = Field(
        None,
        description="largest error of the mean velocity ahead, aside [m/s] and turn rate [rad/s] over whole gaits, "
        "from four steps after a change of the command on",
    )
    commands_limited: int | None = Field(None, description="commands that were granted in part")
    commands_granted: tuple[GrantedCommand, ...] | None = Field(
        None, description="these, the first twenty: `time` [s], and velocity and turn rate `asked` for and `granted`"
    )
    stance_width: float | None = Field(
        None, description="mean lateral distance of successive planned footholds, of whole steps from from_time on [m]"
    )
    stance_width_commanded: float | None = Field(None, description="that of the commanded footholds [m]")
    yaw_drift_deg: float | None = Field(
        description="|mean yaw of the last gait, from the commanded heading, less that at the start|, once a whole "
        "gait was walked [deg]"
    )
    com_rms_error: list[float | None] | None = Field(description="measured less planned CoM in x, y, z, RMS [m]")
    zmp_margin_min: float | None = Field(
        description="least distance of the measured ZMP from the edge of the corners of soles that touch the ground [m]"
    )
    unloaded_ticks: int | None = Field(
        None, description="ticks at which the ground carries nothing, so that there is no ZMP and the last one is kept"
    )
    zmp_outside_fraction: float | None = Field(description="share of samples whose ZMP is outside the box (27)")
    ground: dict[str, PieceMetrics] | None = Field(None, description="of a walk over uneven ground")
    slip_max: float | None = Field(description="farthest that a standing sole moved along the ground [m]")
    sole_gap_min: float | None = Field(
        None, description="least distance of the soles seen from above, negative where they overlap [m]"
    )
    joint_torque_peak: float | None = Field(description="largest torque [N m]")
    torque_limit_hits: int | None = Field(description="samples of a joint's torque at its limit")
    torque_limit_fraction: float | None = Field(
        None, description="share of samples in which a joint's torque is at its limit; up to 0.005 its limits are kept"
    )
    torque_peaks: dict[str, float | None] | None = Field(None, description="largest torque of each joint [N m]")
    torque_margin_min: float | None = Field(
        None,
        description="least distance of a joint's torque from its limit, negative where the plan asks for more than the "
        "joint has [N m]",
    )
    friction_used_max: float | None = Field(
        None, description="largest horizontal over vertical force of the ground on both soles together"
    )
    yaw_moment_used_max: float | None = Field(
        None, description="largest moment of the ground about the vertical through the ZMP, over its vertical force [m]"
    )
    joint_position_margin_min: float | None = Field(description="least distance of a joint from its stop [rad]")
    joint_speed_margin_min: float | None = Field(description="least distance of a joint's speed from its limit [rad/s]")
    late_ticks: float | None = Field(
        None, description="share of the ticks of a driven walk that were late, where it was to keep real time"
    )
    barriers: dict[str, BarrierMetrics]
    mpc: MpcMetrics | None
    estimator: EstimatorMetrics | None = Field(None, description="of a walk on sensors")
    whole_body: WholeBodyMetrics | None = Field(None, description="of a walk with a whole-body program")
    plan_limits: dict[str, BoundMetrics] | None = Field(
        None,
        description="of a walk with mpc.limits, when its plan was at each of them, at step_reach in x and y, and at "
        "the stance_width_min of the disturbed or the steady walk",
    )

    def to_json(self) -> str:
        """The text of metrics.json."""
        return self.model_dump_json(indent=2, by_alias=True) + "\n"
