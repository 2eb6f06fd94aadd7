"""Finds robots: the models folder of a checkout or of an installed package, and robot YAML files."""

from __future__ import annotations

from pathlib import Path

import pdhocbf_drake
from pdhocbf_drake.config import parse_config
from pdhocbf_drake.errors import InputError, ModelError
from pdhocbf_drake.robot.config import RobotConfig
from pdhocbf_drake.yaml_text import read_yaml


def models_folder() -> Path:
    """The folder of models: inside an installed package, or at the top of a checkout."""
    package = Path(str(pdhocbf_drake.__path__[0]))
    for folder in (package / "models", package.parent / "models"):
        if (folder / "package.xml").is_file():
            return folder
    raise ModelError(f"no models folder inside {package} or beside it; is the package installed completely?")


def robot_names() -> list[str]:
    """The robots of the package: `models/NAME/NAME.yaml`."""
    return sorted(path.parent.name for path in models_folder().glob("*/*.yaml") if path.stem == path.parent.name)


def _robot_file(robot: str) -> Path:
    """The YAML file of a robot of the package, given its name, or of any robot, given the path.

    Raises:
        ModelError: there is no such robot.
    """
    if robot in robot_names():
        return models_folder() / robot / f"{robot}.yaml"
    path = Path(robot).expanduser()
    if path.is_file():
        return path
    raise ModelError(f"no robot {robot!r}: give the path of a robot YAML file, or one of: {', '.join(robot_names())}")


def load_robot_config(robot: str) -> RobotConfig:
    """Reads a robot; file names in it become absolute.

    Raises:
        ModelError: no such robot.
        InputError: its file is not YAML, or an entry is unknown, missing or wrong.
    """
    path = _robot_file(robot)
    data = read_yaml(path)
    if data is None:
        raise InputError(f"robot file {path} holds nothing; see models/biped/biped.yaml for what a robot needs")
    config = parse_config(RobotConfig, data, str(path))
    folder = path.resolve().parent
    packages = {name: str(folder / place) for name, place in config.packages.items()}
    return config.model_copy(update={"model": str(folder / config.model), "packages": packages})
