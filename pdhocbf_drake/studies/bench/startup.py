"""The cost of starting against that of importing Drake, and the growth of memory in a long walk."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
from pydrake.systems.analysis import Simulator

from pdhocbf_drake.files.cache import VARIABLE
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.simulate import make_diagram

_START = (
    "from pdhocbf_drake.simulation.scenario_file import load_scenario;"
    "from pdhocbf_drake.simulation.simulate import make_diagram;"
    "diagram = make_diagram(load_scenario({name!r})).diagram"
)
_PREPARE = (
    "; from pdhocbf_drake.systems.unbundled import leaf_of;"
    "leaf_of(diagram.GetSubsystemByName('mpc_controller')).mpc.prepare()"
)


def start_up(scenario: str, rounds: int) -> dict[str, float]:
    """Processor times of fresh interpreters, in turns, medians [s].

    "import_drake_seconds" imports Drake, "ready_seconds" builds a scenario's whole diagram, "prepared_seconds" also
    compiles the programs of a disturbed walk, which are otherwise compiled when they are first needed. Nothing is kept.
    """
    start = _START.format(name=scenario)
    codes = {"ready_seconds": start, "prepared_seconds": start + _PREPARE, "import_drake_seconds": "import pydrake.all"}
    times = [[_spent(code) for code in codes.values()] for _ in range(rounds)]
    return dict(zip(codes, np.median(times, axis=0).tolist(), strict=True))


def _spent(code: str) -> float:
    """Processor time of a fresh interpreter until the code is done, without its end and any cache [s]."""
    timed = f"{code}; import time; print(time.process_time())"
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", VARIABLE: "off"}
    done = subprocess.run([sys.executable, "-c", timed], check=True, env=environment, stdout=subprocess.PIPE, text=True)
    return float(done.stdout.split()[-1])


def resident_growth(scenario: Scenario, duration: float, settle: float) -> float:
    """Bytes by which the resident set grows from `settle` to `duration` [s] of walking, logs emptied each second."""
    logged = make_diagram(scenario)
    simulator = Simulator(logged.diagram)
    simulator.Initialize()
    before = 0
    for second in range(1, round(duration) + 1):
        simulator.AdvanceTo(float(second))
        logged.forget(simulator.get_mutable_context())
        if second == max(1, round(settle)):
            before = resident_bytes()
    return float(resident_bytes() - before)


def resident_bytes() -> int:
    """The resident set of this process [bytes]."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
