"""A run in about ten lines, for the terminal and for the head of a report."""

from __future__ import annotations

from pdhocbf_drake.analysis.metrics_schema import (
    TORQUE_KEPT,
    BarrierMetrics,
    BoundMetrics,
    EstimatorMetrics,
    Metrics,
    MpcMetrics,
    PieceMetrics,
)
from pdhocbf_drake.simulation.scenario import DEFAULT_ROBOT

_ROUNDING = 1e-9
_SAME_SPEED = 5e-4  # [m/s]
_NAMED = 3  # of the commands that were granted in part
_WAYS, _UNITS = ("ahead", "aside", "turning"), ("m/s", "m/s", "rad/s")
_PIECES = {"slope": "a slope", "patch": "a patch of other friction", "blocks": "stepping blocks", "rough": "tiles"}
_STRIDE = "the longest step limits velocities"


def summary_rows(metrics: Metrics) -> list[tuple[str, str]]:
    """(subject, values with units) of everything that applies to the run."""
    rows = [("run", _run(metrics))]
    if metrics.robot not in (None, DEFAULT_ROBOT):
        rows.append(("robot", str(metrics.robot)))
    if metrics.steps_taken is not None:
        rows += [("walk", _walk(metrics, metrics.steps_taken)), ("straightness", _straightness(metrics))]
    rows += [(f"ground.{number}", walked_piece(piece)) for number, piece in (metrics.ground or {}).items()]
    if metrics.path_error_max is not None:
        rows.append(("commands", _commands(metrics)))
    if metrics.com_rms_error is not None and not metrics.template:
        errors = ", ".join(map(mm, metrics.com_rms_error))
        rows.append(("tracking", f"CoM RMS error in x, y, z: {errors}; feet slip at most {mm(metrics.slip_max)}"))
    if metrics.zmp_outside_fraction is not None:
        rows.append(("ZMP", _zmp(metrics, metrics.zmp_outside_fraction)))
    if metrics.joint_torque_peak is not None:
        rows.append(("joints", _joints(metrics)))
    if metrics.friction_used_max is not None:
        rows.append(("ground", _ground(metrics)))
    if at := [f"{name}{_when(limit)}" for name, limit in (metrics.plan_limits or {}).items() if limit.active_ticks]:
        rows.append(("limits of the plan", "; ".join(at)))
    rows += [(f"barrier {name}", _barrier(barrier)) for name, barrier in metrics.barriers.items()]
    if metrics.mpc is not None:
        rows.append(("MPC" if metrics.steps_taken is not None else "filter", _mpc(metrics.mpc)))
    if metrics.estimator is not None:
        rows.append(("estimator", _estimator(metrics.estimator)))
    return rows


def _estimator(estimator: EstimatorMetrics) -> str:
    vx, vy = estimator.velocity_rms
    drift = "" if estimator.position_drift is None else f"drift {100 * estimator.position_drift:.2g} % of the way, "
    text = (
        f"{drift}yaw {estimator.yaw_drift_deg_per_minute:.2g} deg/min; RMS of velocity {1e3 * vx:.1f} and "
        f"{1e3 * vy:.1f} mm/s, of height {mm(estimator.height_rms)}; NEES {estimator.nees:.1f}, within its limit in "
        f"{100 * estimator.nees_within:.0f} % of the gaits"
    )
    if estimator.notices:
        found = ", ".join(f"{n} {notice}" for notice, n in estimator.notices.items())
        text += f"; sensors found wrong at ticks: {found}"
    return text


def _run(metrics: Metrics) -> str:
    pace = f", {metrics.real_time_factor:.2g} times real time" if metrics.real_time_factor else ""
    ending = metrics.ending.upper() if metrics.ending in ("fell", "interrupted") else metrics.ending
    return f"{ending} after {metrics.simulated_seconds:.2f} s, simulated in {metrics.wall_seconds:.1f} s{pace}"


def _walk(metrics: Metrics, steps: int) -> str:
    return (
        f"{count(steps, 'step')}, {of(metrics.distance, 'm')} (commanded {of(metrics.distance_commanded, 'm')}), "
        f"steady speed {of(metrics.mean_speed, 'm/s')}"
    )


def walked_piece(piece: PieceMetrics) -> str:
    """How far the walk came over a piece of ground: "climbed 2 of 4 stairs of 0.05 m"."""
    unseen = "" if piece.known else ", on no map"
    if piece.stairs is None or piece.rise is None:
        return f"walked {piece.walked:.2f} of {piece.length:.2f} m of {_PIECES.get(piece.kind, piece.kind)}{unseen}"
    way = "climbed" if piece.rise > 0.0 else "descended"
    return f"{way} {piece.stairs_taken} of {count(piece.stairs, 'stair')} of {abs(piece.rise):g} m{unseen}"


def _straightness(metrics: Metrics) -> str:
    if metrics.lateral_drift is None:
        return "not judged: no whole gait was walked"
    text = f"lateral drift {mm(metrics.lateral_drift)}"
    if metrics.left_path:
        text += ", more than a sole is wide: THE WALK LEFT ITS PATH"
    if metrics.stance_width is not None:
        text += f", feet {mm(metrics.stance_width)} apart (commanded {mm(metrics.stance_width_commanded)})"
    return text if metrics.template else f"{text}, yaw drift {of(metrics.yaw_drift_deg, 'deg')}"


def _zmp(metrics: Metrics, outside_fraction: float) -> str:
    outside = f"outside its box in {100 * outside_fraction:.1f} % of the samples"
    if metrics.template:
        return outside
    if metrics.unloaded_ticks:
        outside += f"; no load on the ground at {count(metrics.unloaded_ticks, 'tick')}"
    least = metrics.zmp_margin_min
    if least is None or least > -5e-5:
        return f"at least {mm(least if least is None else max(least, 0.0))} inside the soles' edge, {outside}"
    return f"up to {mm(-least)} outside the soles' edge, {outside}"


def _joints(metrics: Metrics) -> str:
    return (
        f"torque up to {of(metrics.joint_torque_peak, 'N m')}, {at_torque_limits(metrics)}; "
        f"to the stops {of(metrics.joint_position_margin_min, 'rad')}, "
        f"to the speed limits {of(metrics.joint_speed_margin_min, 'rad/s')}"
    )


def at_torque_limits(metrics: Metrics) -> str:
    """How often joints are at their torque limits, and whether that is more than walks that keep them are."""
    text, share = f"{count(metrics.torque_limit_hits or 0, 'sample')} at a limit", metrics.torque_limit_fraction
    if not share:  # none, or older metrics
        return text
    text += f", {100.0 * share:.2g} % of the ticks"
    return text if share <= TORQUE_KEPT else f"{text}: TORQUE LIMITS ARE NOT KEPT"


def _ground(metrics: Metrics) -> str:
    return (
        f"friction of {of(metrics.friction_used_max, '1')} is used, "
        f"and a yaw moment of {mm(metrics.yaw_moment_used_max)} times the load"
    )


def _barrier(barrier: BarrierMetrics) -> str:
    text = f"{_margin(barrier)}{_action(barrier)}"
    if not barrier.softened_ticks:
        return text
    slack = of(barrier.slack_max, barrier.unit)
    return f"{text}; softened at {count(barrier.softened_ticks, 'tick')}, by {slack} at most"


def _action(barrier: BarrierMetrics) -> str:
    if barrier.active_ticks is None:  # an older log
        return ""
    if barrier.active_first is None:
        return "; it never acted"
    text = f"; it acted{_when(barrier)}"
    slower = barrier.active_slower
    if slower is None:
        return text
    if abs(slower) < _SAME_SPEED:
        return f"{text}, in steps at the commanded speed"
    way = "slower" if slower >= 0.0 else "faster"
    return f"{text}, in steps that were {of(abs(slower), 'm/s')} {way} than commanded"


def _when(acting: BarrierMetrics | BoundMetrics) -> str:
    return f" at {count(acting.active_ticks or 0, 'tick')}, first at {acting.active_first:.2f} s"


def judged_on(barrier: BarrierMetrics) -> str:
    """On how many ticks a barrier was judged, where these are fewer than a gait; otherwise nothing."""
    return f"judged on {count(barrier.judged_ticks, 'tick')}" if barrier.judged_ticks else ""


def _margin(barrier: BarrierMetrics) -> str:
    if barrier.violations is None:
        return "not judged: the run ended before from_time"
    violations = count(barrier.violations, "violation")
    few = f"; {judged_on(barrier)}" if judged_on(barrier) else ""
    if barrier.violations and barrier.psi_min is not None and barrier.psi_min >= -_ROUNDING:
        violations += " while h goes back to 0 after a change of command, bound or stance foot, as ψ ≥ 0 has it"
    if barrier.h_min is None:
        return f"h is no number at some ticks; {violations}, counting those{few}"
    return (
        f"h at least {of(barrier.h_min, barrier.unit)}, mean {of(barrier.h_mean, barrier.unit)}, "
        f"{violations}; least ψ_{len(barrier.gamma)} {of(barrier.psi_min, barrier.unit)}{few}"
    )


def _commands(metrics: Metrics) -> str:
    text = f"{mm(metrics.path_error_max)} from the path at most"
    if metrics.command_error is not None:
        ahead, aside, turn = metrics.command_error
        text += f", settled within {of(ahead, 'm/s')} ahead, {of(aside, 'm/s')} aside"
        text += "" if turn is None else f", {of(turn, 'rad/s')}"
    limited = metrics.commands_limited
    return f"{text}; {count(limited, 'command')} granted in part{granted(metrics)}" if limited else text


def granted(metrics: Metrics) -> str:
    """What was granted of the first commands that were granted in part, and why not more."""
    said, ways = [], set[str]()
    for command in (metrics.commands_granted or ())[:_NAMED]:
        parts = []
        for name, unit, asked, had in zip(_WAYS, _UNITS, command.asked, command.granted, strict=True):
            if asked != had:
                parts.append(f"{had:.3g} of {asked:.3g} {unit} {name}")
                ways.add("soles that would meet, and 0.3 rad a step, limit turns" if name == "turning" else _STRIDE)
        if parts:
            said.append(f"at {command.time:.2f} s {', '.join(parts)}")
    return f" ({'; '.join(said)}: {', '.join(sorted(ways))})" if said else ""


def _mpc(mpc: MpcMetrics) -> str:
    text = (
        f"{count(mpc.solves, 'solve')} with {mpc.solver}, {count(mpc.failures, 'failure')}, "
        f"{count(mpc.fallbacks, 'fallback')}"
    )
    if mpc.degraded:
        text += f"; degraded ticks: {', '.join(f'{n} {reason}' for reason, n in mpc.degraded.items())}"
    median, p99 = mpc.tick_seconds_median, mpc.tick_seconds_p99
    if median is None or p99 is None:
        return text
    return f"{text}; a tick takes {1e3 * median:.2g} ms, 99 % below {1e3 * p99:.3g} ms"


def count(number: int, noun: str) -> str:
    """ "1 tick", "2 ticks"."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def of(value: float | None, unit: str) -> str:
    """A value with three digits and its unit, or "unknown"."""
    if value is None:
        return "unknown"
    number = f"{value:#.3g}".removesuffix(".") if value else "0"  # 0.18 and 0.188 with as many digits
    return f"{number} {unit}".removesuffix(" 1")


def mm(value: float | None) -> str:
    """A length [m] in millimetres, or "unknown"."""
    return "unknown" if value is None else f"{1e3 * value:.1f} mm"
