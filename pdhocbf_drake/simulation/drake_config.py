"""Drake's own configs inside a scenario: plain data, checked and completed without loading Drake where that can be.

Drake's reader checks types only. Here numbers must be finite too; and each config is tried on one of Drake's objects,
which refuses for example an unknown contact model, unless it differs from the defaults in `time_step` at most.
"""

from __future__ import annotations

import json
import math
from functools import cache, lru_cache
from importlib import metadata
from typing import TYPE_CHECKING, Any, Final, Literal

import yaml

if TYPE_CHECKING:  # Drake is loaded inside functions, so that a scenario is read, and refused, without it
    from pydrake.multibody.plant import MultibodyPlantConfig
    from pydrake.systems.analysis import SimulatorConfig

Part = Literal["plant", "simulator"]

_SCHEMAS: Final[dict[Part, str]] = {"plant": "MultibodyPlantConfig", "simulator": "SimulatorConfig"}

# Defaults that are not Drake's. SAP, since TAMSI ignores the joints' implicit PD gains. Point contact, because
# hydroelastic soles take twice the time. No sampled outputs, because with them the plant steps before the blocks that
# measure it at the same instant. No near-rigid threshold, because it softens contact with the square of the step, and
# at 5 ms the robot falls.
_CHOSEN: Final[dict[Part, dict[str, Any]]] = {
    "plant": {
        "discrete_contact_approximation": "sap",
        "contact_model": "point",
        "use_sampled_output_ports": False,
        "sap_near_rigid_threshold": 0.0,
    },
    "simulator": {},
}

_COMMON: Final[dict[Part, dict[str, Any]]] = {
    "plant": {
        "time_step": 0.001,
        "use_sampled_output_ports": False,
        "penetration_allowance": 0.001,
        "stiction_tolerance": 0.0001,
        "contact_model": "point",
        "discrete_contact_approximation": "sap",
        "sap_near_rigid_threshold": 0.0,
        "contact_surface_representation": "polygon",
        "adjacent_bodies_collision_filters": True,
    },
    "simulator": {
        "integration_scheme": "runge_kutta3",
        "max_step_size": 0.1,
        "accuracy": 0.0001,
        "use_error_control": True,
        "start_time": 0.0,
        "target_realtime_rate": 0.0,
    },
}
# By version of Drake, what it has besides; any other version is loaded and asked.
_BESIDES: Final[dict[str, dict[Part, dict[str, Any]]]] = {
    "1.51.1": {"plant": {}, "simulator": {"publish_every_time_step": False}},
    "1.58.0": {"plant": {}, "simulator": {}},
}
version = cache(metadata.version)  # it searches the installed files
_WORDS: Final = {bool: "true or false", str: "a name"}  # what a key with a default of that type takes; else a number


def plant_config(data: dict[str, Any]) -> MultibodyPlantConfig:
    """Drake's config from scenario data; raises ValueError with one sentence."""
    from pydrake.multibody.plant import MultibodyPlantConfig

    return MultibodyPlantConfig(**completed_plant(data))


def simulator_config(data: dict[str, Any]) -> SimulatorConfig:
    """Drake's config from scenario data; raises ValueError with one sentence."""
    from pydrake.systems.analysis import SimulatorConfig

    return SimulatorConfig(**completed_simulator(data))


def completed_plant(data: dict[str, Any]) -> dict[str, Any]:
    """The data of a `MultibodyPlantConfig` with its defaults written out; raises ValueError with one sentence."""
    config, changed = _completed("plant", data)
    if config["time_step"] < 0.0:  # Drake aborts the process
        raise ValueError(f"time_step must be above 0 s, given {config['time_step']:g}")
    if config["discrete_contact_approximation"] == "tamsi":
        raise ValueError("discrete_contact_approximation tamsi ignores the joints' PD; allowed: sap, similar, lagged")
    if changed - {"time_step"}:
        _try("plant", config)
    return config


def completed_simulator(data: dict[str, Any]) -> dict[str, Any]:
    """The data of a `SimulatorConfig` with its defaults written out; raises ValueError with one sentence."""
    config, changed = _completed("simulator", data)
    if config["start_time"] != 0.0:  # ticks are counted from 0
        raise ValueError(f"start_time must be 0 s, given {config['start_time']:g}")
    if config["max_step_size"] <= 0.0:  # Drake finds it as the simulation starts
        raise ValueError(f"max_step_size must be above 0 s, given {config['max_step_size']:g}")
    if changed:
        _try("simulator", config)
    return config


def defaults(part: Part) -> dict[str, Any]:
    """Every key of a config with its default, where none is chosen Drake's."""
    try:
        besides = _BESIDES.get(version("drake"))
    except metadata.PackageNotFoundError:  # built from source
        besides = None
    return asked_defaults(part) if besides is None else _COMMON[part] | besides[part]


def asked_defaults(part: Part) -> dict[str, Any]:
    """The same, from Drake itself."""
    from pydrake.common.yaml import yaml_dump_typed
    from pydrake.multibody.plant import MultibodyPlantConfig
    from pydrake.systems.analysis import SimulatorConfig

    schema = MultibodyPlantConfig if part == "plant" else SimulatorConfig
    data: dict[str, Any] = yaml.safe_load(yaml_dump_typed(schema(**_CHOSEN[part])))
    return data


def _completed(part: Part, data: dict[str, Any]) -> tuple[dict[str, Any], set[str]]:
    """The data with every default, and which keys differ from it."""
    known = defaults(part)
    for key, value in data.items():
        if key not in known:
            raise ValueError(f"unknown key '{key}'; Drake's {_SCHEMAS[part]} has: {', '.join(sorted(known))}")
        kind = type(known[key])
        number = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
        if not (type(value) is kind if kind in _WORDS else number):
            raise ValueError(f"{key} must be {_WORDS.get(kind, 'a finite number')}, given {value!r}")
    given = {key: type(known[key])(value) for key, value in data.items()}
    return known | given, {key for key, value in given.items() if value != known[key]}


def _try(part: Part, data: dict[str, Any]) -> None:
    _tried(part, json.dumps(data))


@lru_cache(maxsize=64)  # it takes milliseconds, and the runs of a campaign have most configs in common
def _tried(part: Part, text: str) -> None:
    from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
    from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
    from pydrake.systems.framework import DiagramBuilder
    from pydrake.systems.primitives import ConstantVectorSource

    data = json.loads(text)
    try:
        if part == "plant":
            AddMultibodyPlant(MultibodyPlantConfig(**data), DiagramBuilder())
        else:
            ApplySimulatorConfig(SimulatorConfig(**data), Simulator(ConstantVectorSource([0.0])))
    except (RuntimeError, ValueError, SystemExit) as error:  # some of Drake's checks end the process
        reason = str(error).splitlines()[0]
        if isinstance(error, SystemExit):
            reason = reason.rpartition(" in ")[2]  # what follows the place in Drake's code
        raise ValueError(f"is refused by Drake: {reason}") from None
