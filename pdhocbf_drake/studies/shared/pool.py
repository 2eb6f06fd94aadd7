"""Worker processes for simulations that end with the work, since Drake never frees a diagram with Python systems."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any, TypeVar

from pdhocbf_drake.errors import PdhocbfError
from pdhocbf_drake.stopping import ctrl_c_blocked

Work = TypeVar("Work")
Result = TypeVar("Result")


@contextmanager
def worker_pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Processes that start as work is submitted; work that has not begun when the block ends is dropped.

    They are spawned, since a forked child would share Drake's threads and locks. An exception in the block ends them
    at once; Ctrl-C, which a terminal sends to them too, only by that way.
    """
    others = multiprocessing.active_children()
    with _Pool(workers, multiprocessing.get_context("spawn"), _ignore_ctrl_c) as pool:
        try:
            yield pool
        except BaseException:
            for process in multiprocessing.active_children():
                if process not in others:
                    process.terminate()
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


class _Pool(ProcessPoolExecutor):
    """A pool whose processes start with Ctrl-C blocked, until `_ignore_ctrl_c` runs in them."""

    def submit(self, *args: Any, **kwargs: Any) -> Future[Any]:
        with ctrl_c_blocked():
            return super().submit(*args, **kwargs)


def _ignore_ctrl_c() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def result_of(future: Future[Result], advice: str = "") -> Result:
    """The result of submitted work, or the error that it raised.

    Raises:
        PdhocbfError: the worker process died; `advice` ends its message.
    """
    try:
        return future.result()
    except BrokenProcessPool:
        raise PdhocbfError(f"a worker process died{advice}") from None


def in_processes(function: Callable[[Work], Result], work: Sequence[Work], workers: int) -> Iterator[Result]:
    """`function(piece)` for each piece of work, in the order of completion; in this process for one worker or piece.

    Raises:
        PdhocbfError: a worker process died.
    """
    if workers == 1 or len(work) < 2:
        yield from map(function, work)
        return
    with worker_pool(min(workers, len(work))) as pool:
        for future in as_completed([pool.submit(function, piece) for piece in work]):
            yield result_of(future, "; with --workers 1 everything runs in this one")
