"""The prepared process of a worker, which simulates nothing itself: it forks a process for each run.

There is one process a run, because Drake never frees systems written in Python, and so that a crash ends one run only.
What runs have in common is made once, before the fork: imports, the robot, compiled programs, nominal walks.
Where processes can't be forked, the prepared process is itself that of one run.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import threading
import time
from contextlib import suppress
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, Final

from pdhocbf_drake.analysis.metrics import compute_metrics
from pdhocbf_drake.analysis.robot_limits import robot_limits
from pdhocbf_drake.errors import PdhocbfError
from pdhocbf_drake.simulation.build import Walk, WalkParts, build_walk
from pdhocbf_drake.simulation.checks import check_scenario
from pdhocbf_drake.simulation.limits import within_its_limits
from pdhocbf_drake.simulation.not_reached import check_pushed
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.simulate import advance, make_diagram
from pdhocbf_drake.studies.shared.endings import ending_of
from pdhocbf_drake.studies.shared.pool import end_with_parent

IDLE: Final = 60.0  # time without a run after which the process ends [s]
_EXIT = 1.0  # time for a process to end after its answer [s]
_MOST = 32  # programs of axes, and nominal walks, that are kept: those of some ten walks


def run_one(scenario_data: dict[str, Any], walk: Walk | None = None) -> dict[str, Any]:
    """Simulates a scenario.

    Args:
        scenario_data: the scenario.
        walk: its walk, if that is built.

    Returns:
        `{"status": …, "metrics": …, "simulating": seconds}`, see `ending_of`, or `{"error": one sentence}`.
    """
    try:
        scenario = Scenario.from_dict(scenario_data, "scenario")
        check_pushed(scenario)
        started = time.perf_counter()
        logged = make_diagram(scenario, walk=walk, form="fused")
        built = time.perf_counter()
        log = advance(scenario, logged)
        ended = time.perf_counter()
        limits = robot_limits(scenario)
        metrics = compute_metrics(scenario, log, ended - started, limits)
        status = ending_of(scenario, log, None if limits is None else limits.sole_half)
        return {"status": status, "metrics": json.loads(metrics.to_json()), "simulating": ended - built}
    except PdhocbfError as error:
        return {"error": str(error)}
    except Exception as error:
        first = (str(error).splitlines() or ["no message"])[0]
        return {"error": f"unexpected {type(error).__name__}: {first}"}


def prepared(scenario_data: dict[str, Any], parts: WalkParts) -> Walk | None:
    """The walk of a scenario with all its programs; None where there is none, or an error that the run will report."""
    try:
        scenario = Scenario.from_dict(scenario_data, "scenario")
        check_scenario(scenario)
        if scenario.system == "van_der_pol":
            return None
        walk = build_walk(within_its_limits(scenario), parts)
        walk.mpc.prepare()
        return walk
    except Exception:
        return None


def main() -> None:
    """Serves the worker at the other end of standard input, until that closes or asks for no more runs.

    A request is `{"run", "scenario", "fork"}`, and an empty message ends its run, if that has not just ended. The
    answer is that of `run_one`, or `{"died": exit code}`.
    """
    worker, parts = Connection(os.dup(0)), WalkParts(_MOST)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)  # libraries may write to standard output
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while worker.poll(IDLE):
            message = worker.recv_bytes()
            if not message:
                continue
            request = json.loads(message)
            run, scenario = request["run"], request["scenario"]
            if not request["fork"]:
                threading.Thread(target=_end_with, args=(worker,), daemon=True).start()
                _name(run)
                _send(worker, run_one(scenario))
                return
            _send(worker, _forked(run, scenario, prepared(scenario, parts), worker))


def _forked(run: int, scenario: dict[str, Any], walk: Walk | None, worker: Connection) -> dict[str, Any]:
    """The answer of a forked process, which has ended when this returns."""
    context = multiprocessing.get_context("fork")
    answers, answer_to = context.Pipe(duplex=False)
    process = context.Process(target=_answer, args=(run, scenario, walk, worker, answer_to))
    process.start()
    answer_to.close()
    answer = b""
    try:
        if worker in wait([worker, answers]):
            worker.recv_bytes()  # an empty message; where the worker has ended it raises EOFError
        else:
            with suppress(EOFError):  # the process died
                answer = answers.recv_bytes()
    finally:
        if answer:
            process.join(_EXIT)
        process.kill()
        process.join()
        answers.close()
    result: dict[str, Any] = json.loads(answer) if answer else {"died": process.exitcode}
    return result


def _answer(run: int, scenario: dict[str, Any], walk: Walk | None, worker: Connection, answer_to: Connection) -> None:
    worker.close()
    end_with_parent()
    _name(run)
    _send(answer_to, run_one(scenario, walk))


def _send(place: Connection, answer: dict[str, Any]) -> None:
    place.send_bytes(json.dumps(answer).encode())


def _name(run: int) -> None:
    """Names the process for `ps` and `top`, where Linux allows it."""
    with suppress(OSError):
        Path("/proc/self/comm").write_text(f"run-{run}", encoding="ascii")


def _end_with(worker: Connection) -> None:
    with suppress(EOFError, OSError):
        worker.recv_bytes()
    os._exit(1)


if __name__ == "__main__":
    main()
