"""A run in ten lines, for the terminal and for the head of a report."""

from __future__ import annotations

from pdhocbf_drake.analysis.metrics_schema import BarrierMetrics, Metrics


def summary_rows(metrics: Metrics) -> list[tuple[str, str]]:
    """(what, value with units) of everything that applies to this run."""
    rows = [("run", _run(metrics))]
    if metrics.steps_taken is not None:
        rows.append(("walk", _walk(metrics)))
        rows.append(("straightness", _straightness(metrics)))
    if metrics.com_rms_error is not None and not metrics.template:
        rows.append(("tracking", _tracking(metrics)))
    if metrics.zmp_outside_fraction is not None:
        rows.append(("ZMP", _zmp(metrics)))
    if metrics.joint_torque_peak is not None:
        rows.append(("joints", _joints(metrics)))
    rows += [(f"barrier {name}", _barrier(barrier)) for name, barrier in metrics.barriers.items()]
    if metrics.mpc is not None:
        rows.append(("MPC" if metrics.steps_taken is not None else "filter", _mpc(metrics)))
    return rows


def _run(metrics: Metrics) -> str:
    pace = f", {metrics.real_time_factor:.2g} times real time" if metrics.real_time_factor else ""
    ending = {"finished": "finished", "fell": "FELL", "interrupted": "INTERRUPTED"}.get(metrics.ending, metrics.ending)
    return f"{ending} after {metrics.simulated_seconds:.2f} s, simulated in {metrics.wall_seconds:.1f} s{pace}"


def _walk(metrics: Metrics) -> str:
    return (
        f"{_count(metrics.steps_taken or 0, 'step')}, {_of(metrics.distance, 'm')} "
        f"(commanded {_of(metrics.distance_commanded, 'm')}), steady speed {_of(metrics.mean_speed, 'm/s')}"
    )


def _straightness(metrics: Metrics) -> str:
    if metrics.lateral_drift is None:
        return "not judged: no whole gait was walked"
    text = f"lateral drift {_mm(metrics.lateral_drift)}"
    return text if metrics.template else f"{text}, yaw drift {_of(metrics.yaw_drift_deg, 'deg')}"


def _tracking(metrics: Metrics) -> str:
    errors = ", ".join(_mm(error) for error in metrics.com_rms_error or [])
    return f"CoM RMS error in x, y, z: {errors}; feet slip at most {_mm(metrics.slip_max)}"


def _zmp(metrics: Metrics) -> str:
    outside = f"outside its box in {100 * (metrics.zmp_outside_fraction or 0.0):.1f} % of the samples"
    if metrics.template:
        return outside
    least = metrics.zmp_margin_min
    if least is None or least > -5e-5:
        return f"at least {_mm(least if least is None else max(least, 0.0))} inside the soles' edge, {outside}"
    return f"up to {_mm(-least)} outside the soles' edge, {outside}"


def _joints(metrics: Metrics) -> str:
    return (
        f"torque up to {_of(metrics.joint_torque_peak, 'N m')}, {metrics.torque_limit_hits} samples at a limit; "
        f"to the stops {_of(metrics.joint_position_margin_min, 'rad')}, "
        f"to the speed limits {_of(metrics.joint_speed_margin_min, 'rad/s')}"
    )


def _barrier(barrier: BarrierMetrics) -> str:
    if not barrier.softened_ticks:
        return _margin(barrier)
    paid = _of(barrier.slack_max, barrier.unit)
    return f"{_margin(barrier)}; softened at {_count(barrier.softened_ticks, 'tick')}, by {paid} at most"


def _margin(barrier: BarrierMetrics) -> str:
    if barrier.violations is None:
        return "not judged: the run ended before from_time"
    violations = _count(barrier.violations, "violation")
    if barrier.h_min is None:
        return f"h is no number at some ticks; {violations}, counting those"
    return (
        f"h at least {_of(barrier.h_min, barrier.unit)}, mean {_of(barrier.h_mean, barrier.unit)}, "
        f"{violations}; least ψ_{len(barrier.gamma)} {_of(barrier.psi_min, barrier.unit)}"
    )


def _mpc(metrics: Metrics) -> str:
    mpc = metrics.mpc
    if mpc is None:
        return ""
    text = (
        f"{_count(mpc.solves, 'solve')} with {mpc.solver}, {_count(mpc.failures, 'failure')}, "
        f"{_count(mpc.fallbacks, 'fallback')}"
    )
    if mpc.degraded:
        text += f"; degraded ticks: {', '.join(f'{n} {reason}' for reason, n in mpc.degraded.items())}"
    if mpc.tick_seconds_median is None or mpc.tick_seconds_p99 is None:
        return text
    return (
        f"{text}; a tick takes {1e3 * mpc.tick_seconds_median:.2g} ms, 99 % below {1e3 * mpc.tick_seconds_p99:.3g} ms"
    )


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _of(value: float | None, unit: str) -> str:
    if value is None:
        return "unknown"
    number = f"{value:#.3g}".removesuffix(".") if value else "0"  # 0.18 and 0.188 with as many digits
    return f"{number} {unit}".removesuffix(" 1")


def _mm(value: float | None) -> str:
    return "unknown" if value is None else f"{1e3 * value:.1f} mm"
