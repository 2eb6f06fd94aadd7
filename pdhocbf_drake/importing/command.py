"""`pdhocbf import`: a folder with the safe copy of a model, its robot file, a scenario, and a page on all found."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from textwrap import shorten

from pdhocbf_drake.config import as_name
from pdhocbf_drake.config_errors import shown
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.files.folder import new_folder
from pdhocbf_drake.robot.per_joint import ROLES
from pdhocbf_drake.terminal import say, table

_WHAT = "an imported robot"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A model, the folder, and what the model itself does not say."""
    text = "a URDF, SDF or MJCF file, or a name that the package example-robot-data or robot_descriptions has"
    parser.add_argument("model", metavar="MODEL", help=text)
    parser.add_argument("--out", type=Path, metavar="DIR", help="the folder; otherwise one with the model's name here")
    parser.add_argument("--force", action="store_true", help="replace what an earlier import wrote to that folder")
    parser.add_argument("--base", metavar="LINK", help="the link that floats, where the model fixes it to the world")
    parser.add_argument("--forward", choices=("x", "-x", "y", "-y"), help="the axis of the base that points ahead")
    parser.add_argument("--up", choices=("x", "-x", "y", "-y", "z", "-z"), help="that which points up")
    for side in ("left", "right"):
        parser.add_argument(f"--{side}-foot", metavar="LINK", help=f"a link of the {side} foot")
        names = f"the joints of the {side} leg: {', '.join(ROLES)}"
        parser.add_argument(f"--{side}-joints", metavar="A,B,C,D,E,F", type=_names, help=names)
    text = "fix a joint beyond the legs at that angle [rad]; otherwise at zero; may be given several times"
    parser.add_argument("--fix", metavar="JOINT=ANGLE", type=_angle, action="append", default=[], help=text)
    text = "greatest torque of joints of which the model says none [N m]"
    parser.add_argument("--effort", metavar="NM", type=_positive, help=text)
    text = "where package://NAME leads; may be given several times"
    parser.add_argument("--package", metavar="NAME=DIR", type=_package, action="append", default=[], help=text)


def run(options: argparse.Namespace) -> int:
    """Writes the folder and prints what was found; returns the exit code."""
    from pdhocbf_drake.importing.finding import find_model  # here and below, for a quick start

    if (options.left_joints is None) != (options.right_joints is None):
        raise InputError("--left-joints and --right-joints are needed both, or none")
    source = find_model(options.model)
    place = Path(options.out or as_name(source.stem))
    _check_place(place, source, options.force)
    from pdhocbf_drake.files.pages import page
    from pdhocbf_drake.importing.given import Given
    from pdhocbf_drake.importing.importer import PAGE, ROBOT, SCENARIO, import_robot
    from pdhocbf_drake.importing.meshes import FOLDER

    given = Given(
        options.base, options.left_foot, options.right_foot, options.left_joints, options.right_joints,
        options.forward, options.up, dict(options.fix), options.effort, dict(options.package),
    )  # fmt: skip
    entries = (ROBOT, SCENARIO, PAGE, FOLDER, "model.urdf", "model.sdf", "model.xml")
    with new_folder(place, entries, _WHAT) as folder:
        imported = import_robot(source, folder.path, given, lambda words: say(f"{source.name}: {words}"))
        with page(PAGE):
            from pdhocbf_drake.importing.page import write_page

            say(f"{source.name}: drawing {PAGE}")
            write_page(imported, folder.path / PAGE)
    print(table([(fact.what, shorten(fact.value, 72, placeholder=" …"), fact.sure) for fact in imported.facts]))
    for change in imported.changes:
        print(f"changed: {change}")
    for fault in imported.faults:
        print(f"fault of its walk: {fault}")
    print(f"\n{place / PAGE} shows what was found; next: pdhocbf run {place / SCENARIO}")
    return 0


def _check_place(place: Path, source: Path, force: bool) -> None:
    """Raises `InputError` for a folder that is not empty, without --force, or that holds the model itself."""
    if place.is_dir() and place.resolve() in source.resolve().parents:
        raise InputError(f"{place} holds the model itself; give another folder with --out")
    if place.is_dir() and any(place.iterdir()) and not force:
        raise InputError(f"{place} is not empty; give another folder with --out, or --force to import anew")


def _names(text: str) -> Sequence[str]:
    names = tuple(name.strip() for name in text.split(","))
    if len(names) != len(ROLES):
        raise argparse.ArgumentTypeError(f"six names are needed, {', '.join(ROLES)}; given: {len(names)}")
    return names


def _angle(text: str) -> tuple[str, float]:
    name, _, value = text.rpartition("=")
    try:
        return name, float(value) if name else _refuse(text, "JOINT=ANGLE")
    except ValueError:
        return name, _refuse(text, "JOINT=ANGLE")


def _refuse(text: str, form: str) -> float:
    raise argparse.ArgumentTypeError(f"{form} is needed; given: {shown(text)}")


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < 1e6:
        raise argparse.ArgumentTypeError(f"must be above 0 and up to 1e+06 N m; given: {shown(text)}")
    return value


def _package(text: str) -> tuple[str, Path]:
    name, _, folder = text.partition("=")
    if not Path(folder).is_dir() or not name or not folder:
        raise argparse.ArgumentTypeError(f"NAME=DIR with a folder that is there is needed; given: {shown(text)}")
    return name, Path(folder)
