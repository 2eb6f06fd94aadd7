"""`pdhocbf worth`: the same events under no, constant and periodic barriers, over a range of γ."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from pdhocbf_drake.arguments import add_scenario, add_work
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.files.file import replaced_file, write_text
from pdhocbf_drake.files.folder import new_folder
from pdhocbf_drake.files.pages import page
from pdhocbf_drake.simulation.checks import check_straight
from pdhocbf_drake.simulation.run_folder import SCENARIO
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.stopping import stop_requests
from pdhocbf_drake.studies.shared.cases import lent_barriers
from pdhocbf_drake.studies.shared.events import parse_phases
from pdhocbf_drake.studies.shared.pool import check_workers
from pdhocbf_drake.studies.shared.results import write_json
from pdhocbf_drake.terminal import say, shown_progress
from pdhocbf_drake.yaml_text import write_yaml

RESULT, TABLE, FIGURE = "worth.json", "worth.txt", "worth.png"
_ENTRIES = {RESULT, TABLE, FIGURE, SCENARIO}
# Sizes of kick and push to which a barrier can respond: template [m/s, m/s²], robot [N s, N].
_SIZES = {"vhip": (0.02, 0.2), "biped": (3.0, 20.0)}
_COMMAND = 1.07
_FASTEST = 2.0  # times the right stride; longer ones exceed the reach of the legs


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A scenario, the events, the range of γ, and the folder of the results."""
    add_scenario(parser, "; a template (such as vhip) takes a minute, a robot several")
    parser.add_argument("--gamma", default="0.05,0.1,0.2,0.5,1", metavar="LIST", help="class-K rates in (0, 1]")
    parser.add_argument("--phases", default="8", metavar="N|LIST", help="ticks at which events begin, as for push")
    parser.add_argument("--kick", type=float, metavar="SIZE", help="velocity gained [m/s], or on a robot impulse [N s]")
    parser.add_argument("--push", type=float, metavar="SIZE", help="acceleration [m/s²], or on a robot force [N]")
    command = "commanded stride over the right one"
    parser.add_argument("--command", type=float, default=_COMMAND, metavar="FACTOR", help=command)
    add_work(parser, "worth")


def run(options: argparse.Namespace) -> int:
    """Runs the experiments, writes and prints; returns the exit code."""
    scenario = load_scenario(options.scenario, options.text)
    if scenario.system not in _SIZES:
        raise InputError(f"scenario.system: 'vhip' or 'biped' is needed (given: {scenario.system!r})")
    check_straight(scenario)
    gammas = _gammas(options.gamma)
    for name in ("kick", "push", "command"):
        size = getattr(options, name)
        if size is not None and not (math.isfinite(size) and size > 0.0):
            raise InputError(f"--{name} must be a finite number above 0 (given: {size:g})")
    check_workers(options.workers)
    if options.command > _FASTEST:
        raise InputError(f"--command must be {_FASTEST:g} times the right stride at most (given: {options.command:g})")
    kick, push = _SIZES[scenario.system]
    sizes = (options.kick or kick, options.push or push, options.command)
    ticks = scenario.gait.ticks_per_step if scenario.system == "vhip" else scenario.gait.ticks_per_gait
    phases = parse_phases(options.phases, ticks)
    place: Path = options.out or Path("runs") / f"worth-{scenario.name}"
    with new_folder(place, _ENTRIES, "a folder of worth") as folder:
        if lent := lent_barriers(scenario):
            say(lent)
        # Here, since they load Drake: an argument that can't be used is refused at once.
        from pdhocbf_drake.studies.worth.experiments import RobotWorth, TemplateWorth
        from pdhocbf_drake.studies.worth.results import draw, table

        experiment = (TemplateWorth if scenario.system == "vhip" else RobotWorth)(scenario, *sizes, phases)
        with shown_progress("worth", 1 + 2 * len(gammas), "cases", every=True) as progress:
            rows = experiment.run(gammas, progress, options.workers)
            if not experiment.stopped:
                progress(1 + 2 * len(gammas))
        with stop_requests():  # what has been measured is written before such a request takes effect
            print(table(rows), flush=True)  # before the files, since a full disk must not cost the result
            write_json(folder.path / RESULT, {"rows": [row._asdict() for row in rows]})
            write_text(folder.path / TABLE, table(rows) + "\n")
            write_yaml(scenario.to_dict(), folder.path / SCENARIO)
            folder.finish()
            with page(FIGURE), replaced_file(place / FIGURE) as staging:
                draw(rows, staging)
    print(f"wrote {place / RESULT} and a figure beside it")
    if experiment.stopped:
        say(f"pdhocbf: {experiment.stopped}")
    return int(bool(experiment.stopped))


def _gammas(text: str) -> list[float]:
    try:
        gammas = [float(word) for word in text.split(",") if word.strip()]
    except ValueError:
        gammas = []
    if not gammas or not all(0.0 < gamma <= 1.0 for gamma in gammas):
        raise InputError(f"--gamma: a list of rates in (0, 1] is needed, such as 0.1,0.5 (given: {text!r})")
    return gammas
