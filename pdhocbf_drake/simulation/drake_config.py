"""Drake's own configs inside a scenario: plain data, checked and completed by Drake's YAML reader.

Drake's reader checks types only. Here numbers must be finite too, and each config is tried on a temporary object, which
refuses for example an unknown contact model.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar

import yaml
from pydrake.common.yaml import yaml_dump_typed, yaml_load_typed
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from pdhocbf_drake.kept import Kept

T = TypeVar("T")
_WORDS = {bool: "true or false", str: "a name"}  # allowed values of a key whose default is of that type; else a number


def plant_config(data: dict[str, Any]) -> MultibodyPlantConfig:
    """Drake's config from scenario data; raises ValueError with one sentence."""
    # SAP, since TAMSI ignores the joints' implicit PD gains. Point contact, because hydroelastic soles take twice the
    # time. No sampled outputs, because with them the plant steps before the blocks that measure it at the same instant.
    # No near-rigid threshold, because it softens contact with the square of the step, and at 5 ms the robot falls.
    defaults = MultibodyPlantConfig(
        discrete_contact_approximation="sap",
        contact_model="point",
        use_sampled_output_ports=False,
        sap_near_rigid_threshold=0.0,
    )
    config = _load(MultibodyPlantConfig, data, defaults)
    if config.time_step < 0.0:  # Drake aborts the process
        raise ValueError(f"time_step must be above 0 s, given {config.time_step:g}")
    if config.discrete_contact_approximation == "tamsi":
        raise ValueError("discrete_contact_approximation tamsi ignores the joints' PD; allowed: sap, similar, lagged")
    _try(lambda: AddMultibodyPlant(config, DiagramBuilder()), "plant")
    return config


def simulator_config(data: dict[str, Any]) -> SimulatorConfig:
    """Drake's config from scenario data; raises ValueError with one sentence."""
    config = _load(SimulatorConfig, data, SimulatorConfig())
    if config.start_time != 0.0:  # ticks are counted from 0
        raise ValueError(f"start_time must be 0 s, given {config.start_time:g}")
    _try(lambda: ApplySimulatorConfig(config, Simulator(ConstantVectorSource([0.0]))), "simulator")
    return config


def completed(load: Callable[[dict[str, Any]], Any]) -> Callable[[dict[str, Any]], dict[str, Any]]:
    """The function that returns the data of a config with Drake's defaults written out.

    Drake's reader takes milliseconds, and many scenarios have the same configs: the last ones are kept.
    """
    kept = Kept[dict[str, Any]](64)
    return lambda data: dict(kept.get(repr(data), lambda: _dump(load(data))))


def _load(schema: type[T], data: dict[str, Any], defaults: T) -> T:
    known = _dump(defaults)
    for key, value in data.items():
        if key not in known:
            raise ValueError(f"unknown key '{key}'; Drake's {schema.__name__} has: {', '.join(sorted(known))}")
        kind = type(known[key])
        number = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
        if not (type(value) is kind if kind in _WORDS else number):
            raise ValueError(f"{key} must be {_WORDS.get(kind, 'a finite number')}, given {value!r}")
    return yaml_load_typed(schema=schema, data=yaml.safe_dump(data), defaults=defaults)


def _dump(config: Any) -> dict[str, Any]:
    data: dict[str, Any] = yaml.safe_load(yaml_dump_typed(config))
    return data


def _try(build: Callable[[], Any], what: str) -> None:
    try:
        build()
    except (RuntimeError, ValueError) as error:
        raise ValueError(f"Drake refuses this {what} config: {str(error).splitlines()[0]}") from None
