"""Runs of scenarios, made when first needed, kept, and shared by all parts of the reproduction."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ProcessPoolExecutor
from datetime import datetime, timezone
from functools import lru_cache
from types import TracebackType

from pdhocbf_drake.simulation.build import Walk, build_walk
from pdhocbf_drake.simulation.provenance import Provenance
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.studies.reproduce.calibration import Calibration, calibrate

Request = tuple[str, str]
"""A scenario's name and the YAML laid over it."""


class Runs:
    """Runs by scenario and overrides; a worker process simulates ahead while this one evaluates.

    Use as a context, which ends the worker.

    Args:
        tell: called with a line whenever something long begins.
    """

    def __init__(self, tell: Callable[[str], None] = lambda line: None) -> None:
        self.tell = tell
        self._done: dict[Request, Run] = {}
        self._ahead: dict[Request, Future[tuple[RunLog, datetime, float]]] = {}
        self._pool: ProcessPoolExecutor | None = None
        self.walk = lru_cache(maxsize=16)(self._walk)
        self.calibration = lru_cache(maxsize=1)(self._calibration)

    def __enter__(self) -> Runs:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._pool is not None:
            self._pool.shutdown(wait=kind is None, cancel_futures=True)

    def ahead(self, requests: Iterable[Request]) -> None:
        """Lets the worker begin with these, in this order."""
        for request in requests:
            if request not in self._ahead and request not in self._done:
                if self._pool is None:
                    # Spawned: a forked child would share Drake's threads and locks.
                    self._pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"))
                self._ahead[request] = self._pool.submit(_simulated, *request)

    def run(self, name: str, text: str = "") -> Run:
        """The run of a scenario with overrides."""
        request = (name, text)
        if request not in self._done:
            if request in self._ahead:
                log, started, wall = self._ahead.pop(request).result()
            else:
                self.tell(f"simulating {name} {text}".rstrip())
                log, started, wall = _simulated(name, text)
            scenario = load_scenario(name, text)
            self._done[request] = Run(scenario, log, Provenance.of_run(scenario, started, wall))
        return self._done[request]

    def _walk(self, name: str, text: str = "") -> Walk:
        return build_walk(load_scenario(name, text))

    def _calibration(self) -> Calibration:
        self.tell("calibrating the template to (38)")
        return calibrate()


def _simulated(name: str, text: str) -> tuple[RunLog, datetime, float]:
    started, clock = datetime.now(timezone.utc), time.perf_counter()
    return simulate(load_scenario(name, text)), started, time.perf_counter() - clock
