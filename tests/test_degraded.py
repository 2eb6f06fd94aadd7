"""The log names the constraints that plans missed: which barrier, or which constraint of which axis, by how much."""

from __future__ import annotations

import json

import numpy as np
import pytest
import synthetic

from pdhocbf_drake.analysis.degraded import degraded_rows, misses
from pdhocbf_drake.analysis.metrics import compute_metrics
from pdhocbf_drake.analysis.summary import summary_rows
from pdhocbf_drake.cli import main
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.simulation.run_folder import Run, new_run_folder, read_run
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate

NAMES = ("sideways", "loose", "forward")
# The controller has the barriers of x before those of y; the log has them as the scenario does.
THREE = """
duration: 2.6
mpc: {barrier: %s}
pushes: [{time: 2.3, duration: 0.01, force: %s}]
barriers:
  sideways: {axis: y, side: upper, bound: {kind: constant, value: 0.12}, gamma: [0.5, 0.5]}
  loose: {axis: x, side: upper, bound: {kind: constant, value: 1.0}, gamma: [0.3, 0.5]}
  forward: {axis: x, side: upper, bound: {kind: constant, value: 0.4}, gamma: [0.5, 0.5]}
"""


@pytest.mark.parametrize("barrier", ["soft", "hard"])
@pytest.mark.parametrize(("softened", "force"), [("forward", "[580, 0, 0]"), ("sideways", "[0, 850, 0]")])
def test_of_three_barriers_the_log_names_the_softened_one(barrier: str, softened: str, force: str) -> None:
    scenario = load_scenario("vhip_nobarrier", THREE % (barrier, force))
    log = simulate(scenario)
    run = Run(scenario, log, synthetic.provenance())
    slack = log["barrier_slack"]
    kept = [column for column, name in enumerate(NAMES) if name != softened]
    at = np.flatnonzero(log.element("solver_status", "reason") == Reason.SOFTENED)
    assert len(at) > 3
    assert not slack[:, kept].any()
    assert not log["unmet"].any()
    np.testing.assert_array_equal(slack.max(axis=1), log.element("solver_status", "slack"))
    found = misses(run)
    by = slack[at[0], NAMES.index(softened)]
    assert found.words(at[0]) == f"SOFTENED, barrier {softened} by {by:.2g} m/s"
    assert found.ticks[at[0]] == at[0] - 1 == 231  # pushed at tick 230
    metrics = compute_metrics(scenario, log, 1.0, None)
    paid = {name: (each.softened_ticks, each.slack_max) for name, each in metrics.barriers.items()}
    assert paid == {name: (len(at), slack.max()) if name == softened else (0, 0.0) for name in NAMES}
    assert metrics.mpc is not None
    assert metrics.mpc.failures == (len(at) if barrier == "hard" else 0)
    rows = dict(summary_rows(metrics))
    assert [f"softened at {len(at)} ticks, by " in rows[f"barrier {name}"] for name in NAMES] == [
        name == softened for name in NAMES
    ]


def marked(**slack: float) -> Run:
    """A walk with five ticks that were not simply solved."""
    run = synthetic.run("vhip")
    status, rows = run.log["solver_status"], len(run.log)
    run.log.signals["barrier_slack"], run.log.signals["unmet"] = np.zeros((rows, 1)), np.zeros((rows, 6))
    status[60:63, 5] = Reason.SOFTENED
    run.log["barrier_slack"][60:63, 0] = status[60:63, 3] = [0.012, 0.02, 1e-8]
    status[70, 5] = Reason.NO_STEADY_PLAN
    run.log["unmet"][70, [0, 5]] = 0.03, 0.11
    status[71, 5] = Reason.BAD_MEASUREMENT
    return run


def test_each_kind_of_degraded_tick_is_listed_once_with_its_count() -> None:
    assert degraded_rows(marked()) == [
        # The third slack is below NOTICED; of a softened tick the barrier is named all the same.
        ("tick 59", "SOFTENED, barrier forward_speed by 0.012 m/s; 2 more like it"),
        ("tick 69", "NO_STEADY_PLAN, stability x by 0.03 m, step y by 0.11 m"),
        ("tick 70", "BAD_MEASUREMENT"),
    ]
    assert degraded_rows(synthetic.run("vhip")) == []
    assert degraded_rows(synthetic.run("van_der_pol")) == []


def test_many_kinds_are_counted_and_not_listed() -> None:
    run = synthetic.run("vhip")
    run.log["solver_status"][80:88, 5] = np.arange(1, 9)
    rows = degraded_rows(run)
    assert [name for name, _ in rows] == [*(f"tick {k}" for k in range(79, 84)), "later ticks"]
    assert rows[-1][1] == "3 of 3 other kinds, see the log"


def test_a_terminal_set_is_called_by_its_name() -> None:
    run = marked()
    mpc = run.scenario.mpc.model_copy(update={"terminal_set": "sets.npz"})
    run = run._replace(scenario=run.scenario.model_copy(update={"mpc": mpc}))
    assert misses(run).words(70) == "NO_STEADY_PLAN, terminal set x by 0.03 m, step y by 0.11 m"


def test_the_report_lists_degraded_ticks(tmp_path, capsys) -> None:
    with new_run_folder(tmp_path / "run") as folder:
        marked().save(folder)
    assert main(["report", str(tmp_path / "run")]) == 0
    page = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    assert "SOFTENED, barrier forward_speed by 0.012 m/s; 2 more like it" in page
    barrier = json.loads((tmp_path / "run" / "metrics.json").read_text())["barriers"]["forward_speed"]
    assert (barrier["slack_max"], barrier["softened_ticks"]) == (0.02, 2)


def test_an_older_log_without_the_slack_of_each_barrier_has_a_report(tmp_path) -> None:
    run = marked()
    del run.log.signals["barrier_slack"], run.log.signals["unmet"]
    with new_run_folder(tmp_path / "run") as folder:
        run.save(folder)
    assert misses(read_run(tmp_path / "run")).words(60) == "SOFTENED, a barrier by 0.012 m/s"
    assert main(["report", str(tmp_path / "run")]) == 0
    barrier = json.loads((tmp_path / "run" / "metrics.json").read_text())["barriers"]["forward_speed"]
    assert barrier["slack_max"] is None
    assert barrier["softened_ticks"] is None


def test_the_summary_of_a_run_lists_degraded_ticks(tmp_path, capsys) -> None:
    text = "{duration: 2.6, pushes: [{time: 2.3, duration: 0.01, force: [580, 0, 0]}]}"
    assert main(["run", "vhip", "--text", text, "--out", str(tmp_path / "run"), "--no-replay"]) == 0
    lines = [line.split(maxsplit=2) for line in capsys.readouterr().out.splitlines()]
    (tick, missed), *others = [(int(line[1]), line[2]) for line in lines if line[0] == "tick"]
    assert tick == 231
    assert missed.startswith("SOFTENED, barrier forward_speed by 0.0")
    assert not others


def test_a_part_of_a_log_has_the_ticks_of_the_whole_log() -> None:
    run = marked()
    late = RunLog({name: table[50:] for name, table in run.log.signals.items()}, run.log.time[50:])
    assert degraded_rows(run._replace(log=late)) == degraded_rows(run)
