"""Worker processes for simulations that end with the work, since Drake never frees a diagram with Python systems."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess, parent_process
from typing import Any, Final, TypeVar
from unittest.mock import patch

from pdhocbf_drake.errors import InputError, PdhocbfError
from pdhocbf_drake.stopping import ctrl_c_blocked

Work = TypeVar("Work")
Result = TypeVar("Result")

MOST_WORKERS: Final = 1024
"""Processes on one machine."""

ONE_THREAD: Final = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""The environment of a process that has a core for itself: libraries start no further threads."""


def check_workers(workers: int) -> None:
    """Raises `InputError` for a number of processes that can't be started."""
    if not 1 <= workers <= MOST_WORKERS:
        raise InputError(f"workers must be 1 to {MOST_WORKERS} (given: {workers})")


def can_fork() -> bool:
    """Whether processes can be forked; on macOS system libraries don't survive it."""
    return "fork" in multiprocessing.get_all_start_methods() and sys.platform != "darwin"


@contextmanager
def worker_pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Processes that start as work is submitted; work that has not begun when the block ends is dropped.

    They are forked from one that only imports what they need: a child of this one would share Drake's threads and
    locks. Where processes can't be forked, each is spawned. An exception in the block ends them at once, and so does
    the end of this process; Ctrl-C, which a terminal sends to them too, only by that way.
    """
    others = multiprocessing.active_children()
    with _Pool(workers, _context(), _begin) as pool:
        try:
            yield pool
        except BaseException:
            for process in multiprocessing.active_children():
                if process not in others:
                    process.terminate()
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _context() -> BaseContext:
    if not can_fork():
        return multiprocessing.get_context("spawn")
    from multiprocessing import forkserver  # macOS and Windows may lack it

    forkserver.set_forkserver_preload(["pdhocbf_drake.studies.shared.pushing"])
    with ctrl_c_blocked(), patch.dict(os.environ, ONE_THREAD):  # no threads where it forks
        forkserver.ensure_running()
    return multiprocessing.get_context("forkserver")


class _Pool(ProcessPoolExecutor):
    """A pool whose processes start with Ctrl-C blocked, until `_begin` runs in them."""

    def submit(self, *args: Any, **kwargs: Any) -> Future[Any]:
        with ctrl_c_blocked():
            return super().submit(*args, **kwargs)


def _begin() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()


def end_with_parent() -> None:
    """From here on this process ends when the one that it was made for does, also when that one is killed."""
    if (parent := parent_process()) is not None:
        threading.Thread(target=_wait_for, args=(parent,), daemon=True).start()


def _wait_for(parent: BaseProcess) -> None:
    parent.join()
    os._exit(1)


def result_of(future: Future[Result], advice: str = "") -> Result:
    """The result of submitted work, or the error that it raised.

    Raises:
        PdhocbfError: the worker process died; `advice` ends its message.
    """
    try:
        return future.result()
    except BrokenProcessPool:
        raise PdhocbfError(f"a worker process died{advice}") from None


def in_processes(
    function: Callable[[Work], Result],
    work: Sequence[Work],
    workers: int,
    then: Callable[[Result], Iterable[Work]] = lambda result: (),
) -> Iterator[Result]:
    """`function(piece)` for each piece of work, in the order of completion; in this process for one worker or piece.

    `then(result)` is the work that a result makes possible; it comes last.

    Raises:
        PdhocbfError: a worker process died.
    """
    if workers == 1 or len(work) < 2:
        pieces = list(work)
        for piece in pieces:  # which grows
            result = function(piece)
            pieces += then(result)
            yield result
        return
    with worker_pool(min(workers, len(work))) as pool:
        running = {pool.submit(function, piece) for piece in work}
        while running:
            ended, running = wait(running, return_when=FIRST_COMPLETED)
            for future in ended:
                result = result_of(future, "; with --workers 1 everything runs in this one")
                running |= {pool.submit(function, piece) for piece in then(result)}
                yield result
