"""What a run says of each barrier: h, ψ, slack, and the ticks at which it acted."""

from __future__ import annotations

from typing import Any

import numpy as np

from pdhocbf_drake.analysis.barrier_margins import (
    BarrierUse,
    barriers_of,
    bound_along,
    h_along,
    psi_along_log,
    violated,
)
from pdhocbf_drake.analysis.finite import active, finite, statistic
from pdhocbf_drake.analysis.heading import SETTLING, along_heading
from pdhocbf_drake.analysis.metrics_schema import BarrierMetrics
from pdhocbf_drake.barriers.margin import BarrierRecord, record_from_h
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.plan import NOTICED
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario


def barrier_metrics(scenario: Scenario, log: RunLog) -> dict[str, BarrierMetrics]:
    """Those of each barrier by name, judged from `from_time` on."""
    table, walks = {}, scenario.system != "van_der_pol"
    for name, use in barriers_of(scenario).items():
        rows = log.after(scenario.from_time)
        whole = scenario.gait.ticks_per_gait if walks else use.period
        judged = h_along(rows, scenario, use)
        judged = judged[~np.isnan(judged)] if use.changed else judged
        bound = bound_along(log, scenario, use) if "barrier_bound" in log else judged  # the oscillator's is not logged
        magnitude = np.abs(np.nan_to_num([*bound, *judged])).max(initial=0.0)
        slack = log["barrier_slack"][:, use.column] if "barrier_slack" in log else None  # older logs have none
        try:
            record = record_from_h(judged, use.class_k)
        except InputError:  # there is no such row, or one with NaN
            record = None
        table[name] = BarrierMetrics(
            h_min=record.h_min if record else None,
            h_mean=record.h_mean if record else None,
            violations=int(violated(judged, magnitude).sum()) if len(judged) else None,
            judged_ticks=len(judged) if len(judged) < whole else None,
            psi_min=_psi_min(rows, use, record) if record else None,
            slack_max=statistic(np.max, slack) if slack is not None else None,
            softened_ticks=int((slack > NOTICED).sum()) if slack is not None else None,
            **_action(scenario, log, use.column),
            gamma=list(use.gamma),
            relative_degree=use.relative_degree,
            unit=use.unit,
        )
    return table


def _psi_min(rows: RunLog, use: BarrierUse, record: BarrierRecord) -> float | None:
    if not (use.seen_anew or use.changed):
        return finite(record.psi_min)
    psi = psi_along_log(rows, use)
    return statistic(np.min, psi[np.isfinite(psi)])


def _action(scenario: Scenario, log: RunLog, column: int) -> dict[str, Any]:
    """Ticks whose plan a barrier changed, and the walk's speed over the steps in which they are.

    Steps in which the walk gets up to its command are left out, whatever the barrier does then.
    """
    if "barrier_active" not in log:  # an older log
        return {}
    acted = log["barrier_active"][1:, column] > 0.0  # a row holds what was planned at the row before
    found = active(log.time[:-1], acted)
    if "lip_state" not in log or not acted.any():
        return found
    gait, step = scenario.gait, log.element("gait_phase", "step")[:-1]
    whole = (step < step[-1]) & (log.element("gait_phase", "support")[:-1] != 0.0)
    rows = whole & np.isin(step, step[acted]) & (step >= _commanded_since(scenario, log)[:-1] + SETTLING)
    if "path" in log:
        wanted = log.element("path", "forward")[:-1][rows]
        ahead = along_heading(log, "lip_state", 1, 4)[:-1, 0][rows]
        slower = np.sign(wanted) * (wanted - ahead)
        return {**found, "active_slower": statistic(np.mean, slower)}
    commanded = abs(gait.stride) / (gait.ticks_per_step * gait.tick)
    forward = np.copysign(1.0, gait.stride) * log.element("lip_state", "vx")[:-1][rows]
    return {**found, "active_slower": statistic(lambda speeds: commanded - np.mean(speeds), forward)}


def _commanded_since(scenario: Scenario, log: RunLog) -> np.ndarray:
    """The step from which the command of each row holds, (T,); the first one that moves a foot at least."""
    step = log.element("gait_phase", "step")
    changes = np.zeros(len(step))
    if "path" in log:
        changed = np.any(np.diff(log["path"][:, 3:], axis=0, prepend=np.nan) != 0.0, axis=1)
        changes = np.maximum.accumulate(np.where(changed, step, 0.0))
    return np.maximum(changes, scenario.gait.start_steps)
