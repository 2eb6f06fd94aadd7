"""The summary: ten lines with replay and report, failures as plain as successes."""

from __future__ import annotations

import numpy as np
import pytest
import synthetic
from test_analysis_metrics import LIMITS

from pdhocbf_drake.analysis.metrics import compute_metrics
from pdhocbf_drake.analysis.summary import summary_rows
from pdhocbf_drake.mpc.plan import Reason


def summary(system: str = "biped", **kwargs) -> dict[str, str]:
    run = synthetic.run(system, **kwargs)
    limits = LIMITS if system == "biped" else None
    return dict(summary_rows(compute_metrics(run.scenario, run.log, 2.0, limits)))


def test_a_walk_has_nine_lines():
    rows = summary()
    names = ["run", "walk", "straightness", "tracking", "ZMP", "joints", "ground", "barrier forward_speed", "MPC"]
    assert list(rows) == names
    assert rows["walk"].startswith("8 steps, 1.50 m (commanded 1.12 m), steady speed 0.375 m/s")
    assert rows["tracking"].startswith("CoM RMS error in x, y, z: 3.0 mm, 4.0 mm, 5.0 mm")


@pytest.mark.parametrize(("ending", "word"), [("fell", "FELL"), ("interrupted", "INTERRUPTED"), ("lost", "lost")])
def test_a_bad_end_comes_first(ending, word):
    assert summary(ending=ending)["run"].startswith(f"{word} after 4.00 s")


def test_a_template_has_no_lines_on_a_body():
    rows = summary("vhip")
    assert "joints" not in rows
    assert "tracking" not in rows
    assert "yaw" not in rows["straightness"]
    assert "soles" not in rows["ZMP"]


def test_an_oscillator_has_a_line_for_each_barrier():
    assert list(summary("van_der_pol")) == ["run", *(f"barrier x{i}_{s}" for i in (1, 2) for s in ("upper", "lower"))]


def test_failures_of_the_solver_are_counted():
    run = synthetic.run("vhip")
    run.log["solver_status"][60:63, 5] = Reason.RELAXED
    run.log["solver_status"][70, 5] = Reason.SOFTENED
    line = dict(summary_rows(compute_metrics(run.scenario, run.log, 2.0, None)))["MPC"]
    assert line.startswith("400 solves with daqp, 3 failures, 0 fallbacks; degraded ticks: 1 softened, 3 relaxed; a")


def test_one_step_is_singular_and_a_drift_needs_a_whole_gait():
    rows = summary("vhip", duration=1.25)
    assert rows["walk"].startswith("1 step, ")
    assert rows["straightness"] == "not judged: no whole gait was walked"


def test_an_h_that_is_no_number_is_a_violation():
    run = synthetic.run("vhip")
    run.log["h"][300:302] = np.nan
    line = dict(summary_rows(compute_metrics(run.scenario, run.log, 2.0, None)))["barrier forward_speed"]
    assert line == "h is no number at some ticks; 2 violations, counting those"


def test_a_margin_that_was_not_judged_is_not_a_number():
    assert summary(duration=1.0)["barrier forward_speed"] == "not judged: the run ended before from_time"


@pytest.mark.parametrize(("duration", "said"), [(2.0, "; judged on 1 tick"), (2.2, "; judged on 21 ticks"), (4.0, "")])
def test_a_barrier_says_on_how_few_ticks_it_was_judged(duration, said):
    line = summary("vhip", duration=duration)["barrier forward_speed"]
    assert line.endswith(said) if said else "judged" not in line


def test_a_number_that_is_null_is_called_unknown():
    run = synthetic.run()
    run.log["lip_state"][5] = np.nan
    rows = dict(summary_rows(compute_metrics(run.scenario, run.log, 2.0, LIMITS)))
    assert "unknown" in rows["tracking"]
    assert "unknown" in rows["ZMP"]


def test_a_barrier_says_whether_it_acted_when_first_and_how_slow_the_walk_was():
    run = synthetic.run()
    assert "acted" not in summary()["barrier forward_speed"]  # an older log
    active = np.zeros((len(run.log), 1))
    run.log.signals["barrier_active"] = active
    line = dict(summary_rows(compute_metrics(run.scenario, run.log, 2.0, LIMITS)))["barrier forward_speed"]
    assert line.endswith("it never acted")
    active[101:111] = active[261:271] = 1.0  # planned at ticks 100 to 109, as it starts, and 260 to 269, in step 6
    run.log["lip_state"][80:120, 1] -= 0.2
    run.log["lip_state"][240:280, 1] -= 0.1
    found = compute_metrics(run.scenario, run.log, 2.0, LIMITS)
    barrier = found.barriers["forward_speed"]
    assert (barrier.active_ticks, barrier.active_first) == (20, pytest.approx(1.0))
    assert barrier.active_slower == pytest.approx(0.1)
    line = dict(summary_rows(found))["barrier forward_speed"]
    assert line.endswith("it acted at 20 ticks, first at 1.00 s, in steps that were 0.100 m/s slower than commanded")
    same = {"forward_speed": barrier.model_copy(update={"active_slower": -1e-17})}
    line = dict(summary_rows(found.model_copy(update={"barriers": same})))["barrier forward_speed"]
    assert line.endswith("in steps at the commanded speed")


def test_the_width_of_the_walk_stands_beside_the_commanded_one():
    assert "feet 160.0 mm apart (commanded 160.0 mm)" in summary()["straightness"]
