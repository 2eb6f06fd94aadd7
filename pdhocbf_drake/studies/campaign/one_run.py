"""The process of one run: reads a scenario from its standard input, writes the result, and ends.

There is one process a run, because Drake never frees systems written in Python, and so that a crash ends one run only.
The process also ends when its standard input closes, since its worker is then gone.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from typing import Any

from pdhocbf_drake.errors import PdhocbfError


def run_one(scenario_data: dict[str, Any]) -> dict[str, Any]:
    """Simulates a scenario; returns `{"status": …, "metrics": …}`, see `ending_of`, or `{"error": one sentence}`."""
    # Here for start-up time, so that the process ends soon if its worker has died.
    from pdhocbf_drake.analysis.metrics import compute_metrics
    from pdhocbf_drake.analysis.robot_limits import robot_limits
    from pdhocbf_drake.simulation.scenario import Scenario
    from pdhocbf_drake.simulation.simulate import simulate
    from pdhocbf_drake.studies.shared.endings import ending_of

    try:
        scenario = Scenario.from_dict(scenario_data, "scenario")
        started = time.perf_counter()
        log = simulate(scenario)
        wall = time.perf_counter() - started
        limits = robot_limits(scenario)
        metrics = compute_metrics(scenario, log, wall, limits)
        status = ending_of(scenario, log, None if limits is None else limits.sole_half)
        return {"status": status, "metrics": json.loads(metrics.to_json())}
    except PdhocbfError as error:
        return {"error": str(error)}
    except Exception as error:
        first = (str(error).splitlines() or ["no message"])[0]
        return {"error": f"unexpected {type(error).__name__}: {first}"}


def main() -> None:
    """Runs the scenario on standard input and writes its result to standard output."""
    scenario = json.loads(sys.stdin.buffer.readline())
    threading.Thread(target=_end_with_parent, daemon=True).start()
    # Libraries may write to standard output; the result goes through a copy of it.
    answer_to = os.dup(1)
    os.dup2(2, 1)
    answer = run_one(scenario)
    with os.fdopen(answer_to, "w", encoding="utf-8") as stream:
        json.dump(answer, stream)


def _end_with_parent() -> None:
    while os.read(0, 4096):
        pass
    os._exit(1)


if __name__ == "__main__":
    main()
