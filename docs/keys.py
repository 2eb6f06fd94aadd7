"""Writes the tables of scenario.md from the configs' docstrings: `python docs/keys.py`."""

from __future__ import annotations

import inspect
import json
import re
from pathlib import Path

from pydantic import BaseModel

from pdhocbf_drake.estimation.config import EncoderConfig, EstimatorConfig, ForceTorqueConfig, ImuConfig, SensorFault
from pdhocbf_drake.ground.config import Blocks, Boards, Patch, Rough, Slope, Stairs
from pdhocbf_drake.mpc.config import DisturbanceConfig, FilterConfig, MpcConfig, RecoveryConfig, RobustConfig
from pdhocbf_drake.oscillator.config import VanDerPolConfig
from pdhocbf_drake.simulation.scenario import (
    BipedConfig,
    MeasurementConfig,
    MeasurementNoise,
    ModelErrorConfig,
    Push,
    Scenario,
)
from pdhocbf_drake.walking.barrier_config import WalkBarrierConfig, WalkBoundConfig
from pdhocbf_drake.walking.config import GaitConfig, VhipConfig
from pdhocbf_drake.whole_body.config import WholeBodyConfig

PAGE = Path(__file__).parent / "scenario.md"
CONFIGS: dict[str, type[BaseModel]] = {
    "": Scenario,
    "whole_body.": WholeBodyConfig,
    "gait.": GaitConfig,
    "barriers.NAME.": WalkBarrierConfig,
    "barriers.NAME.bound.": WalkBoundConfig,
    "mpc.": MpcConfig,
    "mpc.recovery.": RecoveryConfig,
    "mpc.robust.": RobustConfig,
    "mpc.filter.": FilterConfig,
    "mpc.disturbance.": DisturbanceConfig,
    "ground.0.": Stairs,
    "ground.1.": Slope,
    "ground.2.": Blocks,
    "ground.3.": Boards,
    "ground.4.": Rough,
    "ground.5.": Patch,
    "pushes.0.": Push,
    "measurement.": MeasurementConfig,
    "measurement.noise.": MeasurementNoise,
    "measurement.imu.": ImuConfig,
    "measurement.encoders.": EncoderConfig,
    "measurement.force_torque.": ForceTorqueConfig,
    "measurement.estimator.": EstimatorConfig,
    "measurement.faults.0.": SensorFault,
    "model_error.": ModelErrorConfig,
    "biped.": BipedConfig,
    "vhip.": VhipConfig,
    "van_der_pol.": VanDerPolConfig,
}


def keys_table() -> str:
    """One row a key that holds a value; what groups keys has their rows instead."""
    rows = ["| key | default | meaning |", "|---|---|---|"]
    for prefix, model in CONFIGS.items():
        said = meanings(model)
        for name, field in model.model_fields.items():
            if f"{prefix}{name}." in CONFIGS or any(p.startswith(f"{prefix}{name}.") for p in CONFIGS):
                continue
            key = field.alias or name
            default = "" if field.is_required() else _shown(field.get_default(call_default_factory=True))
            rows.append(f"| `{prefix}{key}` | {default} | {said[key]} |")
    return "\n".join(rows)


def meanings(model: type[BaseModel]) -> dict[str, str]:
    """The text of each field under "Attributes" of a config and its bases; a line may describe several fields."""
    texts = [(inspect.cleandoc(kind.__doc__ or "")).partition("Attributes:\n")[2] for kind in reversed(model.__mro__)]
    entries = re.findall(r"^ {4}(\w[\w, ]*): (.*(?:\n {8}.*)*)", "\n\n".join(texts), re.MULTILINE)
    return {name: re.sub(r"\s*\n\s*", " ", said) for names, said in entries for name in names.split(", ")}


def _shown(default: object) -> str:
    plain = default.model_dump() if isinstance(default, BaseModel) else default
    return f"`{json.dumps(plain)}`".replace(".0`", "`") if plain not in ((), {}, "") else ""


def with_table(text: str) -> str:
    """The page with its table renewed between the marks."""
    mark = re.compile("(<!-- keys -->\n).*?(<!-- end of keys -->)", re.DOTALL)
    return mark.sub(lambda m: f"{m[1]}\n{keys_table()}\n\n{m[2]}", text)


if __name__ == "__main__":
    PAGE.write_text(with_table(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
