"""The task of a Dask worker: has a process simulate one run and returns its result.

It does not load Drake, so that workers stay small and can live as long as their cluster. A worker has threads, and so
can't fork safely itself: it keeps a prepared process that does, see `one_run`.
"""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections import deque
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any, Final

from distributed import get_worker

from pdhocbf_drake.allocation import roomy
from pdhocbf_drake.studies.shared.pool import ONE_THREAD, can_fork

_STOPPING = 5.0  # time for a run to stop when asked to [s]

DIED: Final = "died"


def perform(run: int, scenario: dict[str, Any], seconds: float, topic: str) -> dict[str, Any]:
    """Runs a scenario in a new process.

    Returns:
        `{"status": …, "metrics": …, "simulating": …}`, or `{"error": …}` for a run that failed, or `{"died": …}` for a
        process that was killed; with the worker's address as "worker".
    """
    worker = get_worker()
    # Announces that the run has begun, since a worker that is killed later can't.
    worker.log_event(topic, {"run": run})
    return {**run_process(run, scenario, seconds), "worker": worker.address}


def run_process(run: int, scenario: dict[str, Any], seconds: float) -> dict[str, Any]:
    """The result of `one_run`, whose process has ended when this returns."""
    end = time.monotonic() + seconds
    while True:
        try:
            process = _waiting.pop()
        except IndexError:
            process = _PreparedProcess()
        answer = process.answer({"run": run, "scenario": scenario, "fork": can_fork()}, end)
        if process.reusable:
            _waiting.append(process)
        else:
            process.close()
        if answer is not None:
            return answer or {"error": f"gave no answer in {seconds:g} s"}
        # It had ended before it got the request, since it had nothing to do for some time.


class _PreparedProcess:
    """A process of `one_run`.

    Attributes:
        reusable: whether it can be asked for another run.
    """

    def __init__(self) -> None:
        ours, theirs = socket.socketpair()
        self._complaints = tempfile.TemporaryFile("a+b")  # noqa: SIM115
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "pdhocbf_drake.studies.campaign.one_run"],
                stdin=theirs.fileno(),
                stdout=self._complaints,
                stderr=self._complaints,
                env={**os.environ, **ONE_THREAD, **roomy(os.environ)},
                start_new_session=True,  # Ctrl-C stops the command, which then ends its runs
            )
        self._place = Connection(ours.detach())
        self.reusable = True

    def answer(self, request: dict[str, Any], end: float) -> dict[str, Any] | None:
        """The answer of a run; {} if there is none at the time `end`, None if the process had ended before.

        Args:
            request: see `one_run.main`.
            end: by the monotonic clock [s].
        """
        self._complaints.truncate(0)
        try:
            self._place.send_bytes(json.dumps(request).encode())
            if not self._place.poll(max(0.0, end - time.monotonic())):
                self._stop(request["fork"])
                return {}
            answer: dict[str, Any] = json.loads(self._place.recv_bytes())
        except (EOFError, OSError):
            self.reusable = False
            code = self._process.wait()
            return {DIED: self._cause(code)} if code else None
        self.reusable = request["fork"]
        if DIED in answer:
            answer[DIED] = self._cause(answer[DIED])
        return answer

    def _stop(self, forked: bool) -> None:
        """Stops the run; where only that takes too long, the prepared process too."""
        self.reusable = False
        if forked:
            self._place.send_bytes(b"")
            if self._place.poll(_STOPPING):
                self._place.recv_bytes()
                self.reusable = True

    def close(self) -> None:
        """Ends it, and a run that it has."""
        self._place.close()
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.kill()
        self._process.wait()
        self._complaints.close()

    def _cause(self, code: int) -> str:
        if code < 0:
            return f"the run's process was ended by {signal.Signals(-code).name}"
        self._complaints.seek(0)
        last = (self._complaints.read().decode(errors="replace").strip().splitlines() or [""])[-1]
        return f"the run's process ended with code {code}" + (f": {last}" if last else "")


_waiting: Final[deque[_PreparedProcess]] = deque()
"""Prepared processes without a run; a worker with several threads has several."""
