"""The runs of a campaign as scenarios, all of them checked before the first one starts."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from pdhocbf_drake.config import parse_config
from pdhocbf_drake.errors import InputError, PdhocbfError
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import make_diagram
from pdhocbf_drake.studies.campaign.config import CampaignConfig
from pdhocbf_drake.studies.campaign.factors import has_field, points, set_field
from pdhocbf_drake.yaml_text import merge, read_yaml

_PACKAGED = Path(__file__).resolve().parents[2] / "campaigns"


class PlannedRun(NamedTuple):
    """One run of a campaign.

    Attributes:
        run: its number from 0.
        point: the number of its point in the sample, shared by the runs of all barriers there.
        barrier: the barrier's name.
        factors: each factor's value; None where the barrier has no such field.
        scenario: the whole scenario as plain data.
        fingerprint: of the scenario; a stored result with the same one is of this run.
    """

    run: int
    point: int
    barrier: str
    factors: dict[str, Any]
    scenario: dict[str, Any]
    fingerprint: str


def campaign_names() -> list[str]:
    """The campaigns that come with the package."""
    return sorted(path.stem for path in _PACKAGED.glob("*.yaml"))


def load_campaign(campaign: str) -> tuple[CampaignConfig, Path]:
    """A campaign that comes with the package, or one from a YAML file, and the file.

    Raises:
        InputError: it does not exist, is not YAML, or holds a wrong key or value.
    """
    path = Path(campaign)
    if "/" not in campaign and path.suffix not in (".yaml", ".yml"):
        path = _PACKAGED / f"{campaign}.yaml"
        if not path.is_file():
            known = ", ".join(campaign_names())
            raise InputError(f"unknown campaign '{campaign}'; there are {known}, or give a YAML file")
    data = read_yaml(path)
    if not isinstance(data, dict):
        raise InputError(f"{path} must be a YAML map with scenario and factors, given {data!r}")
    return parse_config(CampaignConfig, data, path.name), path


def plan_runs(config: CampaignConfig, folder: Path) -> list[PlannedRun]:
    """Every run of the campaign.

    Args:
        config: the campaign.
        folder: the folder of its file, to which scenario files are relative.

    Raises:
        InputError: a factor is no field of the scenario, or a scenario is wrong.
    """
    bases = _bases(config, folder)
    planned: list[PlannedRun] = []
    for number, point in enumerate(points(config)):
        for barrier, base in bases.items():
            data, factors = {**base, "seed": point.seed}, dict(point.values)
            for path, value in point.values.items():
                if has_field(data, path):
                    data = set_field(data, path, value)
                else:
                    factors[path] = None
            run = len(planned)
            scenario = Scenario.from_dict(data, f"run {run} ({barrier})").to_dict()
            planned.append(PlannedRun(run, number, barrier, factors, scenario, _fingerprint(scenario)))
    return planned if config.runs is None else planned[: config.runs]


def check_buildable(planned: Sequence[PlannedRun]) -> None:
    """Refuses a campaign none of whose barriers can be built at the sample's first point.

    At other points a factor may lead beyond what can be built; such runs fail one by one.

    Raises:
        InputError, ModelError: the first barrier's scenario can't be built, nor that of any other one.
    """
    first_error: PdhocbfError | None = None
    for run in planned:
        if run.point != planned[0].point:
            break
        try:
            make_diagram(Scenario.from_dict(run.scenario, f"run {run.run}"))
            return
        except PdhocbfError as error:
            first_error = first_error or error
    if first_error is not None:
        raise first_error


def _bases(config: CampaignConfig, folder: Path) -> dict[str, dict[str, Any]]:
    """The scenario of each barrier before any factor is set, with every default written out."""
    name = config.scenario
    if "/" in name or ".yaml" in name or ".yml" in name:
        name = str(folder / name)
    bases = {}
    for barrier, changes in config.barriers.items():
        text = json.dumps(merge(config.overrides, changes))  # JSON is YAML
        try:
            bases[barrier] = load_scenario(name, text).to_dict()
        except InputError as error:
            raise InputError(f"barriers.{barrier}: {error}") from None
    for path in config.factors:
        # A factor may belong to some barriers only, as γ does not to a scenario without barriers.
        if not any(has_field(base, path) for base in bases.values()):
            set_field(next(reversed(bases.values())), path, None)
    return bases


def _fingerprint(scenario: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(scenario, sort_keys=True).encode()).hexdigest()[:16]
