"""A bound designed from a recorded walk, and the YAML file in which it is written."""

from __future__ import annotations

from typing import Any, NamedTuple

import yaml

from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario, scenario_names
from pdhocbf_drake.studies.certify.design import Envelope
from pdhocbf_drake.studies.certify.prediction_errors import PredictionErrors
from pdhocbf_drake.walking.barrier_config import WalkBarrierConfig
from pdhocbf_drake.yaml_text import merge

_WRITTEN = ("quantity", "axis", "side", "bound", "gamma")
_OF_RUN = ("name", "description", "barriers", "duration", "seed", "pushes")  # which a walk under a bound has anew


class Design(NamedTuple):
    """A certified bound.

    Attributes:
        barrier: with the bound.
        envelope: what was measured.
        margin: beyond it, in words with the unit.
        beyond: the margin's meaning, as the file says it.
        verdict: the certificate in one line.
        errors: the prediction errors that the margin is for; None where it was given.
    """

    barrier: WalkBarrierConfig
    envelope: Envelope
    margin: str
    beyond: str
    verdict: str
    errors: PredictionErrors | None


def design_text(recorded: Run, design: Design, name: str) -> str:
    """The recorded walk under the bound, a barrier of that name, as a scenario in YAML."""
    envelope, errors = design.envelope, design.errors
    lines = [
        f"# A bound on the {envelope.quantity.label}, {design.beyond}",
        f"# run of {recorded.scenario.name} ({envelope.periods} times at every phase, {recorded.provenance.started}).",
        f"# Certified for that scenario's template: {design.verdict}.",
    ]
    kept = design.barrier.model_dump(mode="json", exclude_none=True)
    data: dict[str, Any] = {"barriers": {name: {key: kept[key] for key in _WRITTEN if key in kept}}}
    if errors is not None:
        data["mpc"] = {"robust": errors.robust.model_dump(mode="json", exclude_defaults=True)}
    data = merge(_walk(recorded.scenario), data)
    body = yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=110, default_flow_style=None)
    return "\n".join([*lines, body])


def _walk(scenario: Scenario) -> dict[str, Any]:
    """The recorded walk without its barriers: how it differs from the packaged scenario of its name, or all of it."""
    data = {key: value for key, value in scenario.to_dict().items() if key not in _OF_RUN}
    if scenario.name not in scenario_names():
        return data
    packaged = load_scenario(scenario.name).to_dict()
    differs = _differences(data, packaged)
    if packaged["mpc"]["limits"] == "model":  # a run has the numbers
        differs.get("mpc", {}).pop("limits", None)
    return {"extends": scenario.name, **{key: value for key, value in differs.items() if value != {}}}


def _differences(data: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
    """The values of `data` that are others in `other`, each in its place."""
    found = {}
    for key, value in data.items():
        if value != other[key]:
            both = isinstance(value, dict) and isinstance(other[key], dict) and value.keys() == other[key].keys()
            found[key] = _differences(value, other[key]) if both else value
    return found
