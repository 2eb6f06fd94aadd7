"""Simulates a scenario: builds its diagram, advances it to its end, and returns the log."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import get_args

from pydrake.geometry import Meshcat
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorStatus

from pdhocbf_drake.collecting import freed_at_the_end, without_garbage_collection
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.biped_diagram import biped_diagram
from pdhocbf_drake.simulation.build import Walk, build_walk
from pdhocbf_drake.simulation.checks import check_scenario, check_watchable
from pdhocbf_drake.simulation.diagram import oscillator_diagram, vhip_diagram
from pdhocbf_drake.simulation.drake_config import simulator_config
from pdhocbf_drake.simulation.limits import checked_walk
from pdhocbf_drake.simulation.log_rows import Array, LogRows
from pdhocbf_drake.simulation.run_log import FAILED, FELL, FINISHED, INTERRUPTED, RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.weighing import stand, weighed
from pdhocbf_drake.simulation.wiring import Form, LoggedDiagram

Progress = Callable[[float], None]
_CHUNK = 0.1  # [s] of simulated time between two reports of progress
_PICTURE = 1.0 / 30.0  # [s] likewise between two pictures of a walk that is shown
_ROWS = 500  # ticks of which the log is kept in memory where it goes to disk


@without_garbage_collection()
def make_diagram(
    scenario: Scenario, meshcat: Meshcat | None = None, walk: Walk | None = None, form: Form = "blocks"
) -> LoggedDiagram:
    """The scenario's diagram with its log, drawn in `meshcat`.

    Args:
        walk: that of the scenario, if it has been built before.
        form: "blocks" gives a diagram with a block for each part of the controller, "fused" one with a single block for
            all of them, which has the same ports and the same log, and takes less time; without `meshcat` its plant has
            only the shapes that touch.

    Raises:
        InputError, ModelError: the scenario can't be built, or there is no such form.
    """
    if form not in get_args(Form):
        raise InputError(f"the form of a diagram is one of {', '.join(get_args(Form))}, given {form!r}")
    check_scenario(scenario)
    if meshcat is not None:
        check_watchable(scenario)
    if scenario.system == "van_der_pol":
        return oscillator_diagram(scenario)
    if scenario.system == "vhip":
        return vhip_diagram(scenario, walk or build_walk(scenario), form)
    biped, kept = checked_walk(scenario)
    scenario = scenario if walk is not None else kept.scenario
    walk = walk or build_walk(scenario)
    known = weighed(biped, stand(scenario, walk, biped)) if scenario.biped.weigh else biped
    return biped_diagram(scenario, walk, known, meshcat, form, biped)


@freed_at_the_end()
def simulate(
    scenario: Scenario,
    progress: Progress | None = None,
    meshcat: Meshcat | None = None,
    rows: Path | None = None,
    form: Form = "fused",
) -> RunLog:
    """The log of a scenario up to its duration, a fall, a failure in Drake or Ctrl-C; `RunLog.ending` says which.

    Args:
        progress: called as the simulation begins and every 0.1 s of simulated time, with that time [s].
        meshcat: shows the robot while it walks, no faster than real time.
        rows: a new folder to which the log is written while the run goes on. The log that is returned reads from it,
            so that a long run takes no memory; `RunLog.of_killed` reads it if the process is killed.
        form: of the diagram, see `make_diagram`; the log is the same.

    Raises:
        InputError, ModelError: the scenario can't be built; nothing has been simulated.
        RunFolderError: `rows` can't be made.
    """
    return advance(scenario, make_diagram(scenario, meshcat, form=form), progress, meshcat, rows)


def advance(
    scenario: Scenario,
    logged: LoggedDiagram,
    progress: Progress | None = None,
    meshcat: Meshcat | None = None,
    rows: Path | None = None,
    show: Callable[[dict[str, Array]], None] | None = None,
) -> RunLog:
    """What `simulate` does once the scenario's diagram is built.

    Args:
        show: called 30 times a second of simulated time, which is then no faster than real time, with each logged
            signal.
    """
    columns = {name: place.stop - place.start for name, place in logged.columns.items()}
    written = None if rows is None else LogRows(rows, columns)
    simulator = Simulator(logged.diagram)
    ApplySimulatorConfig(simulator_config(scenario.simulator), simulator)
    if meshcat is not None or show is not None:
        simulator.set_target_realtime_rate(1.0)
    for adjust in logged.adjust:
        adjust(simulator.get_mutable_context())
    ending = FINISHED
    try:
        simulator.Initialize()
        now, end = 0.0, _end(scenario)
        if progress is not None:
            progress(now)
        while now < end:
            now = min(now + (_CHUNK if show is None else _PICTURE), end)
            status = simulator.AdvanceTo(now)
            if written is not None:
                logged.hand_over(simulator.get_context(), written, _ROWS)
            if show is not None:
                show(logged.present(simulator.get_context()))
            if progress is not None:
                progress(simulator.get_context().get_time())
            if status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition:
                ending = FELL
                break
    except KeyboardInterrupt:
        ending = INTERRUPTED
    except RuntimeError as error:
        # Drake's plant raises where its state or inputs are NaN; the log holds the ticks before.
        ending = f"{FAILED}: {str(error).splitlines()[0].split('. ')[0]}"
    if written is not None:
        logged.hand_over(simulator.get_context(), written)
    return logged.recorded(simulator.get_context(), ending, written)


def _end(scenario: Scenario) -> float:
    """The duration [s]; of a whole number of ticks, no less than that number times the tick, as Drake rounds it."""
    last = round(scenario.duration / scenario.tick) * scenario.tick
    return max(last, scenario.duration) if abs(last - scenario.duration) < 1e-9 else scenario.duration
