"""`pdhocbf tune`: searches the gait that suits a robot and an aim, and writes it as a scenario."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from pdhocbf_drake.arguments import add_overrides
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.files.file import write_text
from pdhocbf_drake.files.places import check_file
from pdhocbf_drake.robot.per_joint import ROLES
from pdhocbf_drake.simulation.scenario_file import load_scenario, load_written, scenario_names
from pdhocbf_drake.studies.shared.pool import check_workers
from pdhocbf_drake.studies.tune.aims import AIMS
from pdhocbf_drake.terminal import shown_progress
from pdhocbf_drake.yaml_text import merge

if TYPE_CHECKING:
    from pdhocbf_drake.studies.tune.study import Tuned

_MOST_QUICK = 160  # gaits that a search measures at most, about


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A scenario, the aim, and the file."""
    parser.add_argument("scenario", metavar="SCENARIO", help="a name from `pdhocbf list`, or FILE[:NAME]")
    add_overrides(parser)
    aims = "; ".join(f"{name}: {aim.text}" for name, aim in AIMS.items())
    parser.add_argument("--aim", choices=tuple(AIMS), default="torque", help=f"{aims}; otherwise torque")
    parser.add_argument("--joint", choices=ROLES, help="for torque: the joint that counts; otherwise each by its limit")
    keys = "what is searched, such as com_height,com_height_phase; otherwise all that docs/limits.md names"
    parser.add_argument("--keys", metavar="LIST", help=keys)
    confirmed = "how many of the best gaits are simulated, beside the scenario's own; otherwise 2"
    parser.add_argument("--confirm", type=int, default=2, metavar="N", help=confirmed)
    parser.add_argument("--workers", type=int, default=2, metavar="N", help="processes")
    parser.add_argument("--out", type=Path, metavar="FILE", help="the scenario; otherwise ./NAME-AIM.yaml")


def run(options: argparse.Namespace) -> int:
    """Searches, prints and writes; returns the exit code."""
    scenario = load_scenario(options.scenario, options.text)
    check_workers(options.workers)
    keys = None if options.keys is None else [word.strip() for word in options.keys.split(",") if word.strip()]
    if keys == []:
        raise InputError(f"--keys: at least one key is needed (given: {options.keys!r})")
    place: Path = options.out or Path(f"{scenario.name}-{options.aim}.yaml")
    check_file(place)  # before the work
    from pdhocbf_drake.studies.shared.gait_table import table  # here and below, for a quick start
    from pdhocbf_drake.studies.tune.study import tune

    with shown_progress("tune", _MOST_QUICK, "gaits") as progress:
        tuned = tune(
            scenario, aim=options.aim, joint=options.joint, keys=keys, confirmed=options.confirm,
            workers=options.workers, progress=progress,
        )  # fmt: skip
    print(table(tuned.gaits))
    write_text(place, _text(options, tuned))
    if tuned.best is tuned.gaits[0]:
        print(f"of {tuned.tried} gaits none is better than the scenario's own")
    if tuned.asked:
        print(f"even in the best one {tuned.asked}, more than the 90 % that it is to use")
    print(f"wrote {place}")
    return 0


def _text(options: argparse.Namespace, tuned: Tuned) -> str:
    """The scenario: what it changes in a packaged one, or all of it where a user's file is changed."""
    from pdhocbf_drake.studies.tune.study import changes

    best = tuned.best
    torques = ", ".join(f"{role} {peak:.3g}" for role, peak in (best.torque or {}).items())
    lines = [
        f"# Found by `pdhocbf tune {options.scenario} --aim {options.aim}` among {tuned.tried} gaits; simulated:",
        f"# torques [N m] {torques}; {best.speed:.3g} m/s.",
    ]
    lines += [f"# Even so {tuned.asked}."] if tuned.asked else []
    data: dict[str, Any]
    if options.scenario in scenario_names():
        given = load_written(options.scenario, options.text).given
        own = load_scenario(options.scenario)
        data = {"extends": options.scenario, **merge(given, changes(own, tuned.scenario))}
    else:
        data = tuned.scenario.to_dict()
        del data["name"]  # which is the file's
    return "\n".join([*lines, yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=110)])
