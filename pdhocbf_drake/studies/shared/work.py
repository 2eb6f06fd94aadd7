"""One piece of work: a scenario to walk, and where its run is kept."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from pdhocbf_drake.analysis.figures import make_figures, rendered, write_pictures
from pdhocbf_drake.analysis.metrics_schema import Metrics
from pdhocbf_drake.analysis.report import metrics_of, write_metrics
from pdhocbf_drake.analysis.robot_limits import robot_limits
from pdhocbf_drake.files.pages import page
from pdhocbf_drake.simulation.run_folder import FIGURES, Run
from pdhocbf_drake.simulation.run_log import FELL, RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.studies.shared.checks import Check, least, most
from pdhocbf_drake.studies.shared.row_kinds import entry

LEAST_GAP = 0.010  # between the soles, seen from above [m]


class Work(NamedTuple):
    """A piece of work for one process.

    Attributes:
        row: of the table.
        scenario: the walk without commands, as JSON.
        setting: what the row needs besides.
        folder: where run folders are written, one for each row that is a single walk; None writes none.
    """

    row: str
    scenario: str
    setting: Mapping[str, Any]
    folder: str | None = None

    @property
    def run_folder(self) -> str | None:
        """Where the run of a row that is a single walk is kept."""
        return None if self.folder is None else f"{self.folder}/{entry(self.row)}"

    def with_keys(self, **keys: Any) -> Scenario:
        """The scenario with other keys; raises `InputError`."""
        data = Scenario.model_validate_json(self.scenario).to_dict()
        return Scenario.from_dict({**data, **keys}, self.row)


def walked(scenario: Scenario, folder: str | None = None) -> tuple[RunLog, Metrics]:
    """The log and the metrics of a walk; with a folder, its run folder with figures is written there."""
    begun = time.perf_counter()
    log = simulate(scenario)
    run = Run.of(scenario, log, time.perf_counter() - begun)
    if folder is None:
        return log, metrics_of(run)
    place = Path(folder)
    place.mkdir(exist_ok=True)
    run.save(place)
    metrics = write_metrics(run, place)
    with page(f"{place.name}/{FIGURES}"):
        write_pictures(rendered(make_figures(run, robot_limits(scenario))), place / FIGURES)
    return log, metrics


def upright(row: str, metrics: Metrics) -> list[Check]:
    """Checks of every walk: no fall, no fallback, soles apart."""
    found = [most(row, "falls", float(metrics.ending != "finished"), 0.0)._replace(combine="sum")]
    if metrics.mpc is not None:
        found.append(most(row, "fallbacks", metrics.mpc.fallbacks, 0.0)._replace(combine="sum"))
    if metrics.sole_gap_min is not None:
        found.append(least(row, "gap of the soles", 1e3 * metrics.sole_gap_min, 1e3 * LEAST_GAP, "mm"))
    return found


def bounded(row: str, metrics: Metrics) -> list[Check]:
    """h ≥ 0 of each barrier from `from_time` on."""
    rows = metrics.barriers.items()
    return [least(row, f"h of {name}", barrier.h_min, 0.0, barrier.unit) for name, barrier in rows]


def fallen(what: str, metrics: Metrics) -> Sequence[str]:
    """A sentence on a walk that did not reach its end."""
    if metrics.ending == "finished":
        return []
    how = "fell" if metrics.ending == FELL else f"ended ({metrics.ending})"
    return [f"{what} {how} at {metrics.simulated_seconds:.2f} s"]
