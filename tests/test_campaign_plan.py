"""Campaign files, samples and the scenarios they become."""

from __future__ import annotations

import sys

import numpy as np
import pydrake.multibody.plant
import pytest
from campaigns import TINY, campaign_file

from pdhocbf_drake.config import parse_config
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.studies.campaign.config import CampaignConfig
from pdhocbf_drake.studies.campaign.plan import (
    campaign_names,
    check_buildable,
    has_field,
    load_campaign,
    plan_runs,
    set_field,
)

RANDOM = {
    "scenario": "vhip",
    "runs": 300,
    "seed": 1,
    "factors": {
        "friction": {"low": 0.3, "high": 0.9},
        "mpc.horizon": {"low": 80, "high": 83, "integer": True},
        "vhip.mass": {"low": 1.0, "high": 1000.0, "scale": "log"},
        "mpc.tail": {"values": ["periodic", "truncated"]},
    },
}


def config(**changes: object) -> CampaignConfig:
    return parse_config(CampaignConfig, {**RANDOM, **changes}, "campaign")


def test_a_sample_is_the_same_for_the_same_seed_and_grows_without_changing() -> None:
    few, many = list(config(runs=10).points()), list(config(runs=300).points())
    assert few == list(config(runs=10).points())
    assert many[:10] == few
    assert list(config(runs=10, seed=2).points()) != few
    assert len({point.seed for point in many}) == len(many)


def test_draws_keep_to_their_ends_and_fill_the_space_between() -> None:
    drawn = [point.values for point in config().points()]
    friction = np.array([values["friction"] for values in drawn])
    assert friction.min() >= 0.3
    assert friction.max() <= 0.9
    assert abs(friction.mean() - 0.6) < 0.03
    assert {values["mpc.horizon"] for values in drawn} == {80, 81, 82, 83}
    assert {values["mpc.tail"] for values in drawn} == {"periodic", "truncated"}
    # Even in the logarithm: half of the draws are below the geometric mean.
    below = np.mean([values["vhip.mass"] < np.sqrt(1000.0) for values in drawn])
    assert abs(below - 0.5) < 0.1


def test_a_grid_is_the_product_of_its_factors_times_repeats() -> None:
    factors = {"friction": {"low": 0.3, "high": 0.9, "points": 3}, "mpc.tail": {"values": ["periodic", "truncated"]}}
    grid = list(config(sample="grid", runs=None, repeats=2, factors=factors).points())
    assert len(grid) == 12
    assert [point.values["friction"] for point in grid[:6:2]] == pytest.approx([0.3, 0.6, 0.9])
    assert grid[0].values == grid[6].values
    assert grid[0].seed != grid[6].seed


def test_every_point_is_run_with_every_barrier_from_one_seed(tmp_path) -> None:
    tiny, _ = load_campaign(str(campaign_file(tmp_path, runs=7)))
    planned = plan_runs(tiny, tmp_path)
    assert [run.barrier for run in planned] == ["none", "limited"] * 3 + ["none"]
    for none, limited in zip(planned[::2], planned[1::2], strict=False):
        assert none.point == limited.point
        assert none.scenario["seed"] == limited.scenario["seed"]
        assert none.scenario["pushes"] == limited.scenario["pushes"]
        assert none.scenario["pushes"][0]["force"][0] == none.factors["pushes.0.force.0"]
        # There is no decay where there is no barrier.
        assert none.factors["barriers.speed.gamma.0"] is None
        assert limited.scenario["barriers"]["speed"]["gamma"][0] == limited.factors["barriers.speed.gamma.0"]
    assert len({run.fingerprint for run in planned}) == len(planned)


def test_set_field_replaces_one_field_and_leaves_the_original() -> None:
    data = {"pushes": [{"force": [1.0, 2.0, 3.0]}], "gait": {"stride": 0.1}}
    changed = set_field(data, "pushes.0.force.1", 9.0)
    assert changed == {"pushes": [{"force": [1.0, 9.0, 3.0]}], "gait": {"stride": 0.1}}
    assert data["pushes"][0]["force"][1] == 2.0
    assert has_field(data, "gait.stride")
    assert not has_field(data, "gait.strid")
    assert not has_field(data, "pushes.1")


@pytest.mark.parametrize("name", campaign_names())
def test_every_packaged_campaign_can_be_planned(name: str) -> None:
    packaged, path = load_campaign(name, runs=3)
    assert len(plan_runs(packaged, path.parent)) == 3
    assert packaged.description


@pytest.mark.parametrize("name", ["vhip_pushes", "walking_pushes"])
def test_packaged_campaigns_of_pushes_compare_three_barriers(name: str) -> None:
    packaged, path = load_campaign(name)
    planned = plan_runs(packaged, path.parent)
    assert list(packaged.barriers) == ["none", "DCBF", "P-DHOCBF"]
    assert len(planned) == {"biped": 24, "vhip": 200}[planned[0].scenario["system"]]
    bounds = {
        run.barrier: [barrier["bound"]["kind"] for barrier in run.scenario["barriers"].values()] for run in planned
    }
    assert bounds == {"none": [], "DCBF": ["orbit_peak"], "P-DHOCBF": ["orbit"]}


WRONG = [
    ({"factors": {"gait.strid": {"low": 0, "high": 1}}}, "factor 'gait.strid': no field 'strid' in 'gait'; there are "),
    ({"factors": {"pushes.1.force": {"values": [1]}}}, "factor 'pushes.1.force': no entry '1' in 'pushes'; there are "),
    ({"factors": {"friction.x": {"values": [1]}}}, "'friction' is a plain value (0.8) with no field 'x'"),
    ({"factors": {"friction": {"low": 1.0, "high": 0.5}}}, "low must be below high, given 1 and 0.5"),
    ({"factors": {"friction": {"low": 1.0}}}, "a factor has either values, or low and high"),
    ({"factors": {"friction": {"low": 0.1, "high": 0.5, "points": 3}}}, "points belongs to a grid"),
    ({"factors": {"friction": {"low": 0.0, "high": 0.5, "scale": "log"}}}, "needs low above 0, given 0"),
    ({"factors": {}}, "factors"),
    ({"factors": {"friction": {"values": [-1.0]}}}, "run 0 (none).friction: must be above 0"),
    ({"sample": "grid"}, "runs belongs to a random sample"),
    ({"sample": "grid", "runs": None}, "on a grid, factor 'pushes.0.force.0' needs points, or values"),
    ({"runs": None}, "a random sample needs runs"),
    ({"repeats": 2}, "repeats belongs to a grid"),
    ({"scenario": "vhipp"}, "barriers.none: unknown scenario 'vhipp'; there are "),
    ({"barriers": {"none": {"gate": {}}}}, "gate: unknown key; allowed here: "),
    ({"maps": [["friction", "vhip.mass"]]}, "maps: 'friction' is not a factor; there are pushes.0.force.0"),
    ({"sead": 1}, "tiny.yaml.sead: unknown key; allowed here: barriers, description, factors"),
]


@pytest.mark.parametrize(("changes", "sentence"), WRONG)
def test_a_wrong_campaign_is_refused_in_one_sentence(tmp_path, changes: dict, sentence: str) -> None:
    with pytest.raises(InputError) as caught:
        wrong, path = load_campaign(str(campaign_file(tmp_path, **changes)))
        plan_runs(wrong, path.parent)
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


def test_configs_of_drake_that_runs_have_in_common_are_tried_once(tmp_path, monkeypatch) -> None:
    """Which takes longer than all other checks of a scenario together."""
    tried: list[float] = []
    ours = pydrake.multibody.plant.AddMultibodyPlant
    monkeypatch.setattr(
        pydrake.multibody.plant,
        "AddMultibodyPlant",
        lambda config, builder: tried.append(config.penetration_allowance) or ours(config, builder),
    )
    allowances = [0.0013, 0.0017, 0.0019]
    varied = {**TINY["factors"], "plant.penetration_allowance": {"values": allowances}}
    reported: list[tuple[int, int]] = []
    tiny, _ = load_campaign(str(campaign_file(tmp_path, runs=1200, factors=varied)))
    planned = plan_runs(tiny, tmp_path, lambda done, total: reported.append((done, total)))
    assert {run.scenario["plant"]["penetration_allowance"] for run in planned} == set(allowances)
    assert sorted(tried) == allowances
    assert reported == [(0, 1200), (500, 1200), (1000, 1200)]


def test_a_campaign_that_cannot_be_built_is_refused_before_it_runs(tmp_path) -> None:
    overrides = {**TINY["overrides"], "gait": {**TINY["overrides"]["gait"], "com_height_amplitude": 0.01}}
    wrong, path = load_campaign(str(campaign_file(tmp_path, overrides=overrides)))
    with pytest.raises(InputError, match="com_height_amplitude"):
        check_buildable(plan_runs(wrong, path.parent))


def test_a_campaign_that_does_not_exist_is_refused() -> None:
    with pytest.raises(
        InputError,
        match="unknown campaign 'pushes'; there are vhip_pushes, walking_commands, walking_margin, walking_pushes, "
        "walking_terrain",
    ):
        load_campaign("pushes")


def test_without_the_extra_the_command_names_what_to_install(monkeypatch, capsys) -> None:
    from pdhocbf_drake.cli import main

    for name in ("distributed", "pdhocbf_drake.studies.campaign.store", "pdhocbf_drake.studies.campaign.dispatch"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main(["campaign", "vhip_pushes"]) == 1
    assert "a campaign needs the package 'distributed'; install them all with pip install" in capsys.readouterr().err
