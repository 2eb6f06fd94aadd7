"""The task of a Dask worker: starts the process of one run and returns its result.

It does not load Drake, so that workers stay small and can live as long as their cluster.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from typing import Any, Final

from distributed import get_worker

# Each core has one run, so libraries must not start further threads.
_ONE_THREAD = {name: "1" for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")}

DIED: Final = "died"


def perform(run: int, scenario: dict[str, Any], seconds: float, topic: str) -> dict[str, Any]:
    """Runs a scenario in a new process.

    Returns:
        `{"status": …, "metrics": …}`, or `{"error": …}` for a run that failed, or `{"died": …}` for a process that
        was killed; with the worker's address as "worker".
    """
    worker = get_worker()
    # Announces that the run has begun, since a worker that is killed later can't.
    worker.log_event(topic, {"run": run})
    return {**run_process(run, scenario, seconds), "worker": worker.address}


def run_process(run: int, scenario: dict[str, Any], seconds: float) -> dict[str, Any]:
    """The result of `one_run`, whose process has ended when this returns."""
    reading, writing = os.pipe()
    with os.fdopen(writing, "wb", buffering=0) as lifeline:
        process = subprocess.Popen(
            [sys.executable, "-m", "pdhocbf_drake.studies.campaign.one_run", f"run-{run}"],
            stdin=reading,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env={**os.environ, **_ONE_THREAD},
            start_new_session=True,  # Ctrl-C stops the command, which then ends its runs
        )
        os.close(reading)
        try:
            lifeline.write(json.dumps(scenario).encode() + b"\n")
            answer, complaint = process.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            return {"error": f"gave no answer in {seconds:g} s"}
        except BrokenPipeError:
            answer, complaint = process.communicate()
        finally:
            process.kill()
            process.wait()
    if process.returncode:
        return {DIED: _cause(process.returncode, complaint.decode(errors="replace"))}
    parsed: dict[str, Any] = json.loads(answer)
    return parsed


def _cause(code: int, complaint: str) -> str:
    last = (complaint.strip().splitlines() or [""])[-1]
    if code < 0:
        return f"the run's process was ended by {signal.Signals(-code).name}"
    return f"the run's process ended with code {code}" + (f": {last}" if last else "")
