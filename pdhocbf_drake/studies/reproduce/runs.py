"""Runs of scenarios, simulated when first needed, kept, and shared by all parts of the reproduction."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from concurrent.futures import Future
from contextlib import ExitStack
from datetime import datetime, timezone

from pdhocbf_drake.simulation.build import Walk, build_walk
from pdhocbf_drake.simulation.provenance import Provenance
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.studies.shared.pool import result_of, worker_pool

Request = tuple[str, str]
"""A scenario's name and the YAML that is laid over it."""


class Runs(ExitStack):
    """Runs and walks of scenarios, each made once; a worker process simulates ahead while this one evaluates.

    Use as a context, which ends the worker.

    Attributes:
        report: called with a few words when a long step begins.
    """

    def __init__(self) -> None:
        super().__init__()
        self.report: Callable[[str], None] = lambda words: None
        self._done: dict[Request, Run] = {}
        self._ahead: dict[Request, Future[tuple[RunLog, datetime, float]]] = {}
        self._walks: dict[Request, Walk] = {}

    def prepare(self, requests: Iterable[Request]) -> None:
        """Has the worker process simulate these, in this order."""
        if wanted := dict.fromkeys(requests):
            pool = self.enter_context(worker_pool(1))
            self._ahead |= {request: pool.submit(_simulated, *request) for request in wanted}

    def end(self, error: BaseException) -> None:
        """Ends the worker at once, for an error that ends the work."""
        self.__exit__(type(error), error, error.__traceback__)

    def run(self, request: Request) -> Run:
        """The run of a scenario."""
        if request not in self._done:
            if request in self._ahead:
                log, started, wall = result_of(self._ahead.pop(request))
            else:
                self.report("simulating " + " ".join(request).rstrip())
                log, started, wall = _simulated(*request)
            scenario = load_scenario(*request)
            self._done[request] = Run(scenario, log, Provenance.of_run(scenario, started, wall))
        return self._done[request]

    def walk(self, request: Request) -> Walk:
        """The walk of a scenario, its controller compiled."""
        if request not in self._walks:
            self._walks[request] = build_walk(load_scenario(*request))
        return self._walks[request]


def _simulated(name: str, text: str) -> tuple[RunLog, datetime, float]:
    """The log, when the simulation began, and the time that it took [s]."""
    started, clock = datetime.now(timezone.utc), time.perf_counter()
    return simulate(load_scenario(name, text)), started, time.perf_counter() - clock
