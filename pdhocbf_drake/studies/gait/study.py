"""The study of gaits as a function: one line for each parameter of the gait, and a map over two of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path

from pdhocbf_drake.errors import PdhocbfError
from pdhocbf_drake.files.file import write_text
from pdhocbf_drake.files.folder import new_folder
from pdhocbf_drake.simulation.run_folder import SCENARIO
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.stopping import stop_requests
from pdhocbf_drake.studies.gait.plan import Grid, default_lines, plan
from pdhocbf_drake.studies.gait.results import LINES, MAP, document, write_figures
from pdhocbf_drake.studies.shared.gait_measures import GaitMeasures, measure
from pdhocbf_drake.studies.shared.gait_table import table
from pdhocbf_drake.studies.shared.pool import in_processes
from pdhocbf_drake.studies.shared.results import collected, write_json
from pdhocbf_drake.yaml_text import write_yaml

RESULT, TABLE = "gait.json", "gait.txt"
_ENTRIES = {RESULT, TABLE, LINES, MAP, SCENARIO}


def gait_study(
    scenario: Scenario,
    *,
    lines: Grid | None = None,
    over: Grid | None = None,
    directions: Sequence[str] = (),
    phases: Sequence[int] = (),
    workers: int = 1,
    out: str | Path | None = None,
    progress: Callable[[int], None] | None = None,
) -> list[GaitMeasures]:
    """Measures gaits around a scenario's own one.

    Args:
        scenario: a walk without an end, on the robot or on the template.
        lines: for each key the values that it takes while all others are the scenario's; None: `default_lines`.
        over: keys and values of which every combination is measured; None: none.
        directions, phases: pushes to try on the robot, see `push`; none by default, since they take the longest.
        workers: processes; with more than one, the calling script needs `if __name__ == "__main__":`.
        out: a folder for gait.json, gait.txt, figures and the scenario.
        progress: called with the number of gaits measured so far.

    Raises:
        InputError: the scenario is no walk without an end, or a key can't be varied.
        RunFolderError: `out` can't be written. PdhocbfError: a worker process died, or Ctrl-C ended the work; what had
            been measured is in `out` all the same.
    """
    work = plan(scenario, default_lines(scenario) if lines is None else lines, over or {}, directions, phases)
    with nullcontext() if out is None else new_folder(Path(out), _ENTRIES, "a folder of gait") as folder:
        measured = ([gait] for gait in in_processes(measure, work, workers))
        gaits, stopped = collected(measured, folder is not None, progress)
        with stop_requests():  # what has been measured is written before such a request takes effect
            order = [str(piece.values) for piece in work]
            gaits.sort(key=lambda gait: order.index(str(gait.values)))
            if folder is not None and out is not None:
                write_text(folder.path / TABLE, table(gaits) + "\n")
                write_json(folder.path / RESULT, document(scenario, gaits))
                write_yaml(scenario.to_dict(), folder.path / SCENARIO)
                folder.finish()
                write_figures(gaits, Path(out))
    if stopped:
        raise PdhocbfError(f"{stopped}; {len(gaits)} of {len(work)} gaits are in {out}")
    return gaits
