"""The whole-body program in a walk of the robot: nothing changes without a limit, and a limit is kept."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from logs import differences
from test_joint_limits import walking, weaker

from pdhocbf_drake.analysis.metrics import compute_metrics
from pdhocbf_drake.analysis.robot_limits import robot_limits
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate


def test_a_walk_within_its_limits_is_the_same_with_the_program_and_without() -> None:
    without, auto = (
        simulate(load_scenario("walking", f"{{duration: 1.3, whole_body: {{kind: {kind}}}}}"))
        for kind in ("closed_form", "auto")
    )
    own = RunLog({name: auto[name] for name in without.signals}, auto.time)
    assert differences(own, without) == []
    assert not auto["whole_body"].any()
    assert "whole_body" not in without


def test_a_weak_knee_gets_no_more_than_it_has(tmp_path: Path) -> None:
    scenario = walking(weaker(tmp_path, knee_pitch=38.0), duration=2.4, whole_body={"kind": "auto"})
    scenario = scenario.model_copy(update={"mpc": scenario.mpc.model_copy(update={"limits": None})})
    log = simulate(scenario)
    assert log.ending == "finished"
    assert np.abs(log["feedforward"][:, [3, 9]]).max() <= 38.0
    metrics = compute_metrics(scenario, log, 1.0, robot_limits(scenario))
    assert metrics.whole_body is not None
    assert metrics.whole_body.active_ticks > 10
    assert set(metrics.whole_body.misses) <= {"torque"}
    assert 0.02 < np.abs(log.element("whole_body", "torso")).max() <= 0.5
