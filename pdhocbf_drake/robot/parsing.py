"""Parses a robot's model file into a plant: one sentence for what Drake refuses, each of its warnings once."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.robot.config import RobotConfig
from pdhocbf_drake.robot.model_text import joint_texts

_SUFFIXES = {".urdf", ".sdf", ".xml"}
_PLACE = re.compile(r"^\S+:\d+: (warning: |error: )?")  # of what a message of Drake is about


def parse_model(plant: MultibodyPlant, config: RobotConfig) -> ModelInstanceIndex:
    """Adds the one model of the robot's file to a plant that is not finalized.

    Raises:
        ModelError: the file or a package folder is missing, Drake can't read it, or it holds several models.
    """
    path = Path(config.model)
    if not path.is_file():
        models = (other.name for other in path.parent.glob("*.*") if other.suffix in _SUFFIXES)
        raise ModelError(
            f"robot {config.name!r}: no model file {path}; model files in that folder: {listed(models) or 'none'}"
        )
    parser = Parser(plant)
    parser.SetAutoRenaming(True)
    for name, folder in config.packages.items():
        if not Path(folder).is_dir():
            raise ModelError(f"robot {config.name!r}: packages.{name}: there is no folder {folder}")
        parser.package_map().Add(name, folder)
    with refusals(f"robot {config.name!r}: {path}", path), warnings_once():
        instances = parser.AddModels(path)
    if len(instances) != 1:
        raise ModelError(f"robot {config.name!r}: {path} holds {len(instances)} models, one is allowed")
    return instances[0]


def listed(names: Iterable[str]) -> str:
    """Names for a message, sorted."""
    return ", ".join(sorted(name for name in names if name))


@contextmanager
def refusals(what: str, path: Path) -> Iterator[None]:
    """Raises a `ModelError` of one sentence, `what` being its subject, for what Drake refuses inside."""
    try:
        yield
    except RuntimeError as error:
        raise ModelError(f"{what} can't be read: {_refused(path, str(error))}") from None
    except SystemExit as error:  # some of Drake's checks end the process
        raise ModelError(f"{what} can't be read: {_ended(path, str(error))}") from None


@contextmanager
def warnings_once() -> Iterator[None]:
    """A model is parsed several times for a run; each kind of warning of Drake is logged the first time alone."""
    logger = logging.getLogger("drake")
    logger.addFilter(_is_new)
    try:
        yield
    finally:
        logger.removeFilter(_is_new)


def _is_new(record: logging.LogRecord) -> bool:
    before = _seen.cache_info().misses
    _seen(_PLACE.sub("", record.getMessage()))
    return _seen.cache_info().misses > before


@cache
def _seen(message: str) -> None:
    """Its cache holds the messages that have been logged."""


def _refused(path: Path, message: str) -> str:
    first = _PLACE.sub("", message.splitlines()[0])
    if "form one or more loops" in first:
        return f"its joints form loops, and those of a robot that walks form a tree{_twice_held(path)}"
    formats = (".stl", ".dae", ".glb")
    if any(suffix in first.lower() for suffix in formats):
        return f"{first}; Drake reads meshes in OBJ, glTF and VTK; `pdhocbf import` converts others"
    return first


def _twice_held(path: Path) -> str:
    """A link that hangs from two joints, for a message."""
    joints = joint_texts(path)
    for name, joint in joints.items():
        others = [other for other in joints if joints[other].child == joint.child and other != name]
        if joint.child and others:
            return f": {joint.child!r} hangs from {listed([name, *others])}"
    return ""


def _ended(path: Path, message: str) -> str:
    for name, joint in joint_texts(path).items():
        if joint.lower is not None and joint.upper is not None and joint.lower > joint.upper:
            return f"joint {name!r} has a lower limit of {joint.lower:g} above its upper one of {joint.upper:g}"
    return f"Drake refuses it: {message.splitlines()[0] if message else 'no reason given'}"
