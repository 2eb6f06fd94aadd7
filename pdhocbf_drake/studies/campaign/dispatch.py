"""Submits runs to Dask's workers and yields the result of each, in the order in which they end.

A run whose worker or process dies is begun once more; if that dies too, the run has failed. A dead worker reports
nothing, so each begun run is announced as an event of the scheduler and counted here.
"""

from __future__ import annotations

import asyncio
import threading
import uuid
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import suppress
from typing import Any, Final, NamedTuple

from distributed import Client, Future, KilledWorker, wait

from pdhocbf_drake.errors import ClusterError
from pdhocbf_drake.studies.campaign.cluster import threads
from pdhocbf_drake.studies.campaign.plan import PlannedRun
from pdhocbf_drake.studies.campaign.task import DIED, perform

ATTEMPTS: Final = 2
_SUBMISSIONS: Final = 5  # a worker may also die before it begins a run that waits there
_POLL = 0.5  # [s]
_GONE, _DIED = "the Dask scheduler went away", "its worker died"
_FETCH, _FETCHES = 10.0, 30  # [s] for a row to arrive, and how often it is asked for while a worker has it
_AHEAD = 3  # runs submitted at a time for each core


class Outcome(NamedTuple):
    """The result of a run.

    Attributes:
        planned: the run.
        status: how it ended, one of `shared.endings`; None if it failed.
        metrics: as in metrics.json; None if it failed.
        error: why it failed.
        attempts: times it was begun.
        worker: address of the worker that ended it.
        simulating: time from the start of its simulation to the end [s]; 0 if it failed.
    """

    planned: PlannedRun
    status: str | None
    metrics: dict[str, Any] | None
    error: str | None
    attempts: int
    worker: str | None
    simulating: float = 0.0


def dispatch(client: Client, runs: Sequence[PlannedRun], seconds: float) -> Iterator[Outcome | None]:
    """Performs all runs; yields None every half second in which none ends, so that the caller may stop.

    Raises:
        ClusterError: the scheduler went away.
    """
    yield from _Dispatcher(client, seconds).outcomes(list(runs))


class _Dispatcher:
    def __init__(self, client: Client, seconds: float) -> None:
        self._client, self._seconds = client, seconds
        self._topic = f"pdhocbf-campaign-{uuid.uuid4().hex}"
        self._begun: Counter[int] = Counter()
        self._submitted: Counter[int] = Counter()
        self._late: Counter[Future] = Counter()
        self._lock = threading.Lock()
        self._running: dict[Future, PlannedRun] = {}

    def outcomes(self, waiting: list[PlannedRun]) -> Iterator[Outcome | None]:
        waiting.reverse()
        self._client.subscribe_topic(self._topic, self._count)
        try:
            while waiting or self._running:
                room = _AHEAD * max(1, threads(self._client)) - len(self._running)
                for _ in range(min(room, len(waiting))):
                    self._submit(waiting.pop())
                ended = self._ended()
                for future in ended:
                    answer = self._answer(future)
                    if answer is None:
                        yield None
                        continue
                    planned = self._running.pop(future)
                    outcome = self._outcome(future, planned, answer)
                    future.release()
                    if outcome is None:
                        self._submit(planned)
                    else:
                        yield outcome
                if not ended:
                    yield None
        except (OSError, CancelledError):  # raised by any call to Dask without a scheduler
            raise ClusterError(_GONE) from None
        finally:
            with suppress(OSError, CancelledError):
                self._close()

    def _submit(self, planned: PlannedRun) -> None:
        self._submitted[planned.run] += 1
        key = f"{self._topic}-run-{planned.run}-{self._submitted[planned.run]}"
        future = self._client.submit(
            perform, planned.run, planned.scenario, self._seconds, self._topic,
            key=key, pure=False, priority=-planned.run,
        )  # fmt: skip
        self._running[future] = planned

    def _ended(self) -> list[Future]:
        """Futures that are done, or that the scheduler began too often by itself."""
        with suppress(asyncio.TimeoutError, CancelledError):  # the first is not yet the builtin one in Python 3.10
            wait(list(self._running), timeout=_POLL, return_when="FIRST_COMPLETED")
        if self._client.status != "running":
            raise ClusterError(_GONE)
        # A result whose worker died before it was fetched is "lost": the scheduler begins its run again.
        done = [future for future in self._running if future.status in ("finished", "error", "cancelled")]
        return done or [future for future, planned in self._running.items() if self._times_begun(planned) > ATTEMPTS]

    def _answer(self, future: Future) -> dict[str, Any] | None:
        """What `task.perform` returned; empty for a run without an answer, None where one may still come."""
        if future.status != "finished":
            return {}
        try:
            answer: dict[str, Any] = future.result(timeout=_FETCH)
        except asyncio.TimeoutError:  # of a machine that is busy with other things, as long as a worker has the answer
            self._late[future] += 1
            if self._late[future] < _FETCHES and any(self._client.who_has([future]).values()):
                return None
            return {DIED: _DIED, "worker": None}
        except (CancelledError, KilledWorker, OSError):
            return {DIED: _DIED, "worker": None}  # the worker died after its run, before the result was fetched
        return answer

    def _outcome(self, future: Future, planned: PlannedRun, answer: dict[str, Any]) -> Outcome | None:
        """The result of the run; None if it is to be begun again."""
        begun = self._times_begun(planned)
        cause, worker = _DIED, None
        if answer:
            if DIED not in answer:
                status, metrics, error = (answer.get(key) for key in ("status", "metrics", "error"))
                simulating = answer.get("simulating", 0.0)
                return Outcome(planned, status, metrics, error, max(begun, 1), answer["worker"], simulating)
            cause, worker = answer[DIED], answer["worker"]
        elif future.status == "error" and not isinstance(future.exception(), KilledWorker):
            raised = future.exception()
            return Outcome(planned, None, None, f"{type(raised).__name__}: {raised}", max(begun, 1), None)
        else:
            future.cancel()
        if begun < ATTEMPTS and self._submitted[planned.run] < _SUBMISSIONS:
            return None
        return Outcome(planned, None, None, f"{cause}, {max(begun, 1)} times", max(begun, 1), worker)

    def _times_begun(self, planned: PlannedRun) -> int:
        with self._lock:
            return self._begun[planned.run]

    def _count(self, event: tuple[float, Any]) -> None:
        # Dask calls this in another thread.
        message = event[1]
        if isinstance(message, dict) and "run" in message:
            with self._lock:
                self._begun[int(message["run"])] += 1

    def _close(self) -> None:
        if self._client.status == "running":
            self._client.unsubscribe_topic(self._topic)
            self._client.cancel(list(self._running), force=True)
