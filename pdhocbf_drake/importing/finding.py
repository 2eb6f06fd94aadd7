"""The model file that a user names: a path, or a name that a package of robot models has."""

from __future__ import annotations

import importlib
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from pdhocbf_drake.config_errors import shown
from pdhocbf_drake.errors import InputError, reason

_EXAMPLES = "example-robot-data"
_SUFFIXES = (".urdf", ".sdf", ".xml", ".mjcf")


def find_model(model: str) -> Path:
    """The file of a model.

    Args:
        model: a URDF, SDF or MJCF file, the name of a file of the package example-robot-data without its ending, or
            of a module of robot_descriptions.

    Raises:
        InputError: there is none; the message lists the names there are.
    """
    path = Path(model).expanduser()
    if path.is_file():
        if path.suffix.lower() not in _SUFFIXES:
            raise InputError(f"{path} is no model: a file ending in {', '.join(_SUFFIXES)} is needed")
        return path
    if "/" in model or path.suffix.lower() in _SUFFIXES:
        raise InputError(f"there is no model file {shown(model)}")
    examples = _example_models()
    if model in examples:
        return examples[model]
    if model.isidentifier() and (described := _described(model)):
        return described
    there = (
        f"{_EXAMPLES} has {', '.join(sorted(examples))}" if examples else f"the package {_EXAMPLES} is not installed"
    )
    raise InputError(f"no model {shown(model)}: give a URDF, SDF or MJCF file, or a name of a package; {there}")


def _example_models() -> dict[str, Path]:
    """The models of example-robot-data by the stems of their files, empty if it is not installed."""
    try:
        files = distribution(_EXAMPLES).files or []
    except PackageNotFoundError:
        return {}
    found = (Path(str(file.locate())) for file in files if file.suffix in (".urdf", ".sdf"))
    return {path.stem: path.resolve() for path in found if path.is_file()}


def _described(model: str) -> Path | None:
    """The model of a module of robot_descriptions, which downloads it; None if that package or module is missing."""
    package, name = "robot_descriptions", f"robot_descriptions.{model}"
    try:
        module = importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name in (package, name):
            return None
        raise InputError(f"{package} needs the package {error.name!r}, which is not installed") from None
    except Exception as error:  # of git, of the network
        of_git = str(getattr(error, "stderr", "")).rpartition("fatal: ")[2].strip(" '\n")
        raise InputError(
            f"{package} can't download {shown(model)}, for which it needs a network: {of_git or reason(error)}"
        ) from None
    place = getattr(module, "URDF_PATH", None) or getattr(module, "MJCF_PATH", None)
    return Path(place) if place else None
