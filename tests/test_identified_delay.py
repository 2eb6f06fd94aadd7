"""`pdhocbf delay`: the delay and the lag of a recorded walk are found from its log."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pdhocbf_drake.analysis.late import lagging, late
from pdhocbf_drake.cli.main import main
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate


def recorded(text: str) -> Run:
    scenario = load_scenario("vhip", text)
    return Run.of(scenario, simulate(scenario), 0.0)


@pytest.mark.parametrize("delay", [0, 1, 4])
def test_the_delay_of_a_log_is_found_whatever_was_stated(delay: int) -> None:
    run = recorded(f"{{duration: 5, measurement: {{delay_ticks: {delay}}}, mpc: {{delay: 2}}}}")
    found = late(run)
    assert (found.delay, found.zmp_lag) == (delay, None)
    assert found.agree == found.gaits >= 3
    assert found.spreads[delay] < 1e-9 < 1e-4 < np.delete(found.spreads, delay).min()


def test_a_lag_of_the_zmp_is_found() -> None:
    run = recorded("duration: 5")
    eta, tick = run.log["com_height"], 0.01
    sent = run.log["zmp_reference"][:, ::2]
    zmp, state = lagging(sent, 0.2), np.array(run.log["lip_state"])
    eta = (eta[:, 2] + 9.81) / eta[:, 0]
    for k in range(len(state) - 1):  # a pendulum that starts like the walk, and stays near it by a pull on its position
        for axis in (0, 1):
            c, v = state[k, 3 * axis : 3 * axis + 2]
            state[k + 1, 3 * axis] = run.log["lip_state"][k + 1, 3 * axis]
            state[k + 1, 3 * axis + 1] = v + tick * eta[k] * (c - zmp[k, axis])
    tables = {name: run.log[name] for name in ("zmp_reference", "gait_phase")} | {"lip_state": state}
    found = late(Run.of(run.scenario, RunLog(tables, run.log.time), 0.0))
    assert (found.delay, found.zmp_lag) == (0, 20.0)


def test_a_run_too_short_to_say_is_refused_and_the_command_prints_the_keys(tmp_path: Path, capsys) -> None:
    with pytest.raises(InputError, match=r"two gaits of 0\.8 s after 2 s are needed"):
        late(recorded("duration: 3"))
    recorded("{duration: 4.5, measurement: {delay_ticks: 3}}").save(tmp_path)
    assert main(["delay", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "measured 3 ticks late (30 ms): 3 of 3 gaits say so" in said
    assert "mpc: {delay: 3, zmp_lag: null}" in said
