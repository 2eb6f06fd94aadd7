"""Real robots: imported and walked with nothing edited, where their models are on this machine.

Models are looked for under the folder that the variable PDHOCBF_ROBOTS names, then in the package example-robot-data.
"""

from __future__ import annotations

import json
import os
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import pytest
import yaml
from sound_walks import OTHER_WALKS, check_sound, check_walked, other_walk
from test_check import WRONG, Change

from pdhocbf_drake.analysis.metrics import compute_metrics
from pdhocbf_drake.analysis.metrics_schema import Metrics
from pdhocbf_drake.analysis.robot_limits import robot_limits
from pdhocbf_drake.errors import InputError, ModelError
from pdhocbf_drake.fitting.robot_checks import robot_findings
from pdhocbf_drake.importing.finding import find_model
from pdhocbf_drake.importing.given import Given
from pdhocbf_drake.importing.importer import ROBOT, SCENARIO, import_robot
from pdhocbf_drake.simulation.limits import within_its_limits
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate

WALKING = (
    "g1_29dof_rev_1_0", "g1_12dof", "h1_2_handless", "talos_reduced", "hrp4", "HRP4Cmain", "jvrc1", "jaxon_jvrc",
    "atlas_minimal_contact", "valkyrie_D", "XBot-L", "T1_locomotion", "icub_reduced", "alexander_v1.lowerBodyOnly",
)  # fmt: skip
REFUSED = {
    "solo12": "legs|feet|limbs", "bolt": "six revolute joints|no foot geometry", "cassie": "joint",
    "cassie_v2": "form loops", "h1": "has 5: ", "nao": "'RHipYawPitch' of a leg follows 'LHipYawPitch'",
}  # fmt: skip


def place_of(name: str) -> Path:
    """The model with that name; skips the test where there is none."""
    folder = os.environ.get("PDHOCBF_ROBOTS")
    for suffix in (".urdf", ".sdf") if folder else ():
        if found := sorted(Path(str(folder)).rglob(f"{name}{suffix}")):
            return found[0]
    try:
        return find_model(name)
    except InputError as error:
        pytest.skip(f"no model {name} under PDHOCBF_ROBOTS, nor in a package: {error}")


@cache
def imported(source: Path) -> Path:
    """The folder of a model that is imported once for all tests."""
    folder = Path(mkdtemp())
    import_robot(source, folder, Given(), lambda words: None)
    return folder


def walked(name: str, changes: dict[str, object]) -> Metrics:
    """A walk of an imported robot, within what its joints grant."""
    file = str(imported(place_of(name)) / SCENARIO)
    scenario = within_its_limits(load_scenario(file, json.dumps(changes)))
    return compute_metrics(scenario, simulate(scenario), scenario.from_time, robot_limits(scenario))


@pytest.mark.parametrize("name", WALKING)
def test_a_real_robot_walks_as_imported(name: str) -> None:
    check_sound(walked(name, {"duration": 30.0}))


@pytest.mark.parametrize("walk", OTHER_WALKS)
@pytest.mark.parametrize("name", WALKING)
def test_a_real_robot_in_other_walks(name: str, walk: str) -> None:
    own = load_scenario(str(imported(place_of(name)) / SCENARIO))
    check_walked(walked(name, other_walk(own, walk)), walk)


@pytest.mark.parametrize("change", WRONG, ids=lambda change: change.__name__)
@pytest.mark.parametrize("name", WALKING)
def test_a_wrong_entry_of_a_real_robot_is_named(name: str, change: Change) -> None:
    folder = imported(place_of(name))
    data = yaml.safe_load((folder / ROBOT).read_text())
    change(data)
    wrong = folder / "wrong.yaml"
    wrong.write_text(yaml.safe_dump(data))
    worst = next(finding for finding in robot_findings(str(wrong)) if finding.level != "ok")
    assert worst.key.startswith(WRONG[change][0])


@pytest.mark.parametrize("name", REFUSED)
def test_a_real_robot_that_is_no_such_biped_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises((ModelError, InputError), match=REFUSED[name]):
        import_robot(place_of(name), tmp_path, Given(), lambda words: None)
