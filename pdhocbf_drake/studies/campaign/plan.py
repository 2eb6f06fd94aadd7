"""The runs of a campaign as scenarios, all checked before the first one starts, and fields by their dotted paths."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from pdhocbf_drake.config import parse_config
from pdhocbf_drake.errors import InputError, PdhocbfError
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.campaign.config import CampaignConfig
from pdhocbf_drake.studies.shared.command_sequences import CAMPAIGNS
from pdhocbf_drake.yaml_text import merge, read_yaml

_OFTEN = 500  # runs checked between two reports


class PlannedRun(NamedTuple):
    """One run of a campaign.

    Attributes:
        run: its number from 0.
        point: the number of its point in the sample, shared by the runs of all barriers there.
        barrier: the barrier's name.
        factors: each factor's value; None where the barrier has no such field.
        fingerprint: hash of the scenario; a stored result belongs to this run if it has the same one.
        seed: of the scenario.
        base: the barrier's scenario before any factor is set, as plain data.
    """

    run: int
    point: int
    barrier: str
    factors: dict[str, Any]
    fingerprint: str
    seed: int
    base: dict[str, Any]

    @property
    def scenario(self) -> dict[str, Any]:
        """The whole scenario as plain data, made anew each time, since all of them together take much memory."""
        data, _ = _with_factors(self.base, self.seed, self.factors)
        return Scenario.from_dict(data, f"run {self.run} ({self.barrier})").to_dict()


def campaign_names() -> list[str]:
    """The campaigns that come with the package."""
    return sorted(path.stem for path in CAMPAIGNS.glob("*.yaml"))


def load_campaign(campaign: str, **changes: int | None) -> tuple[CampaignConfig, Path]:
    """A campaign that comes with the package, or one from a YAML file, and the file.

    Args:
        campaign: its name or file.
        changes: other values of its keys; None keeps that of the file.

    Raises:
        InputError: it does not exist, is not YAML, or holds a wrong key or value.
    """
    path = Path(campaign)
    if "/" not in campaign and path.suffix not in (".yaml", ".yml"):
        path = CAMPAIGNS / f"{campaign}.yaml"
        if not path.is_file():
            names = ", ".join(campaign_names())
            raise InputError(f"unknown campaign '{campaign}'; there are {names}, or give a YAML file")
    data = read_yaml(path)
    if not isinstance(data, dict):
        raise InputError(f"{path} must be a YAML map with scenario and factors, given {data!r}")
    given = {name: value for name, value in changes.items() if value is not None}
    return parse_config(CampaignConfig, {**data, **given}, path.name), path


def plan_runs(
    config: CampaignConfig, folder: Path, checked: Callable[[int, int], None] = lambda done, total: None
) -> list[PlannedRun]:
    """Every run of the campaign, its scenario checked.

    Args:
        config: the campaign.
        folder: the folder of its file, to which scenario files are relative.
        checked: called with the number of runs that are checked, now and then, and that of all runs.

    Raises:
        InputError: a factor is no field of the scenario, or a scenario is wrong.
    """
    bases = _bases(config, folder)
    planned: list[PlannedRun] = []
    for number, point in enumerate(config.points()):
        for barrier, base in bases.items():
            data, factors = _with_factors(base, point.seed, point.values)
            run = len(planned)
            scenario = Scenario.from_dict(data, f"run {run} ({barrier})").to_dict()
            planned.append(PlannedRun(run, number, barrier, factors, _fingerprint(scenario), point.seed, base))
            if run % _OFTEN == 0:
                checked(run, config.size())
    return planned if config.runs is None else planned[: config.runs]


def check_buildable(planned: Sequence[PlannedRun]) -> None:
    """Refuses a campaign none of whose barriers can be built at the sample's first point.

    Runs at other points fail one by one where a factor has a value that can't be built.

    Raises:
        InputError, ModelError: the first barrier's scenario can't be built, nor that of any other one.
    """
    from pdhocbf_drake.simulation.simulate import make_diagram  # here, since it loads Drake, for a quick start

    errors = []
    for run in planned:
        if run.point != planned[0].point:
            break
        try:
            make_diagram(Scenario.from_dict(run.scenario, f"run {run.run}"))
            return
        except PdhocbfError as error:
            errors.append(error)
    if errors:
        raise errors[0]


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


def _with_factors(base: dict[str, Any], seed: int, values: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """A scenario with a seed and the factors that it has fields for; and all of them, None for the others."""
    data, factors = {**base, "seed": seed}, dict(values)
    for path, value in values.items():
        if has_field(data, path):
            data = set_field(data, path, value)
        else:
            factors[path] = None
    return data, factors


def _fingerprint(scenario: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(scenario, sort_keys=True).encode()).hexdigest()[:16]


def has_field(data: Any, path: str) -> bool:
    """Whether the field with that dotted path exists, such as "gait.stride", "pushes.0.force.1"."""
    try:
        set_field(data, path, None)
    except InputError:
        return False
    return True


def set_field(data: Any, path: str, value: Any) -> Any:
    """A copy of plain `data` with the field at a dotted path replaced.

    Raises:
        InputError: there is no such field; the message lists those that exist.
    """
    return _replaced(data, path.split("."), value, path, "")


def _replaced(data: Any, rest: list[str], value: Any, path: str, done: str) -> Any:
    if not rest:
        return value
    here, *below = rest
    where, inside = (f"{done}.{here}", f" in '{done}'") if done else (here, "")
    if isinstance(data, dict):
        if here not in data:
            raise InputError(
                f"factor '{path}': no field '{here}'{inside}; there are {', '.join(map(str, data)) or 'none'}"
            )
        return {**data, here: _replaced(data[here], below, value, path, where)}
    if isinstance(data, list):
        if not here.isdecimal() or int(here) >= len(data):
            there = f"numbers 0 to {len(data) - 1}" if data else "none, since the list is empty"
            raise InputError(f"factor '{path}': no entry '{here}'{inside}; there are {there}")
        index = int(here)
        return [*data[:index], _replaced(data[index], below, value, path, where), *data[index + 1 :]]
    raise InputError(f"factor '{path}': '{done}' is a plain value ({data!r}) with no field '{here}'")
