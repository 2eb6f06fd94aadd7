"""Runs of scenarios, made when first needed, kept, and shared by all parts of the reproduction."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import ExitStack
from datetime import datetime, timezone
from functools import lru_cache
from typing import Any

from pdhocbf_drake.simulation.build import Walk, build_walk
from pdhocbf_drake.simulation.provenance import Provenance
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.studies.reproduce.calibration import Calibration, calibrate
from pdhocbf_drake.studies.shared.pool import result_of, worker_pool

Request = tuple[str, str]
"""A scenario's name and the YAML laid over it."""


class Runs:
    """Runs by scenario and overrides; a worker process simulates ahead while this one evaluates.

    Use as a context, which ends the worker.

    Attributes:
        report: called with a few words when a long step begins.
    """

    def __init__(self) -> None:
        self.report: Callable[[str], None] = lambda words: None
        self._done: dict[Request, Run] = {}
        self._ahead: dict[Request, Future[tuple[RunLog, datetime, float]]] = {}
        self._stack = ExitStack()
        self._pool: ProcessPoolExecutor | None = None
        self.walk = lru_cache(maxsize=16)(self._walk)
        self.calibration = lru_cache(maxsize=1)(self._calibration)

    def __enter__(self) -> Runs:
        return self

    def __exit__(self, *error: Any) -> None:
        self._stack.close()

    def prepare(self, requests: Iterable[Request]) -> None:
        """Has the worker process simulate these, in this order."""
        for request in requests:
            if request not in self._ahead and request not in self._done:
                if self._pool is None:
                    self._pool = self._stack.enter_context(worker_pool(1))
                self._ahead[request] = self._pool.submit(_simulated, *request)

    def run(self, name: str, text: str = "") -> Run:
        """The run of a scenario with overrides."""
        request = (name, text)
        if request not in self._done:
            if request in self._ahead:
                log, started, wall = result_of(self._ahead.pop(request))
            else:
                self.report(f"simulating {name} {text}".rstrip())
                log, started, wall = _simulated(name, text)
            scenario = load_scenario(name, text)
            self._done[request] = Run(scenario, log, Provenance.of_run(scenario, started, wall))
        return self._done[request]

    def _walk(self, name: str, text: str = "") -> Walk:
        return build_walk(load_scenario(name, text))

    def _calibration(self) -> Calibration:
        self.report("calibrating the template to (38)")
        return calibrate()


def _simulated(name: str, text: str) -> tuple[RunLog, datetime, float]:
    started, clock = datetime.now(timezone.utc), time.perf_counter()
    return simulate(load_scenario(name, text)), started, time.perf_counter() - clock
