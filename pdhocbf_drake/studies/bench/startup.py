"""What starting costs against importing Drake, and whether memory grows."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import NamedTuple

import numpy as np
from pydrake.systems.analysis import Simulator

from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.simulate import make_diagram

_IMPORT = "import pydrake.all"
_START = (
    "from pdhocbf_drake.simulation.scenario_file import load_scenario;"
    "from pdhocbf_drake.simulation.simulate import make_diagram; make_diagram(load_scenario({name!r}))"
)
_PREPARE = (
    "from pdhocbf_drake.simulation.scenario_file import load_scenario;"
    "from pdhocbf_drake.simulation.simulate import make_diagram; from pdhocbf_drake.systems.unbundled import leaf_of;"
    "scenario = load_scenario({name!r});"
    "diagram = make_diagram(scenario).diagram; leaf_of(diagram.GetSubsystemByName('mpc_controller')).mpc.prepare()"
)


class StartUp(NamedTuple):
    """Processor times of fresh interpreters, medians [s].

    Attributes:
        imported: importing Drake. ready: building a scenario's whole diagram.
        prepared: the same, and compiling what plans a disturbed walk, which otherwise waits until it is needed.
    """

    imported: float
    ready: float
    prepared: float


def start_up(scenario: str, rounds: int) -> StartUp:
    """Times starts, in turns."""
    times = []
    for _ in range(rounds):
        ready, prepared = _spent(_START.format(name=scenario)), _spent(_PREPARE.format(name=scenario))
        times.append([_spent(_IMPORT), ready, prepared])
    return StartUp(*np.median(times, axis=0).tolist())


def _spent(code: str) -> float:
    """Processor time until the code is done; taking the interpreter down again is no part of a start."""
    timed = f"{code}; import time; print(time.process_time())"
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
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
            before = _resident()
    return float(_resident() - before)


def _resident() -> int:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
