"""The process of one run: reads a scenario from its standard input, writes what became of it, and ends.

A process a run, because systems written in Python are never freed, and because whatever kills a run then kills
nothing else. It ends as well when its standard input closes, since whoever wanted the answer is gone then.
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
    """Simulates a scenario; gives `{"status": …, "metrics": …}`, see `ending_of`, or `{"error": one sentence}`."""
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
    """The process."""
    scenario = json.loads(sys.stdin.buffer.readline())
    threading.Thread(target=_end_with_parent, daemon=True).start()
    # Libraries may write to standard output; the answer goes through a copy of it that only we know.
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
