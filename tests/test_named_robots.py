"""Real robots: imported and walked with nothing edited, where their models are on this machine.

Models are looked for under the folder that the variable PDHOCBF_ROBOTS names, then in the package example-robot-data.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from sound_walks import check_sound

from pdhocbf_drake.analysis.metrics import compute_metrics
from pdhocbf_drake.analysis.robot_limits import robot_limits
from pdhocbf_drake.errors import InputError, ModelError
from pdhocbf_drake.importing.finding import find_model
from pdhocbf_drake.importing.given import Given
from pdhocbf_drake.importing.importer import SCENARIO, import_robot
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate

WALKING = ("g1_29dof_rev_1_0", "g1_12dof", "h1_2_handless", "talos_reduced", "hrp4", "icub_reduced", "romeo")
REFUSED = {"solo12": "legs|feet|limbs", "bolt": "six revolute joints", "cassie": "joint"}


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


@pytest.mark.parametrize("name", WALKING)
def test_a_real_robot_walks_as_imported(name: str, tmp_path: Path) -> None:
    import_robot(place_of(name), tmp_path, Given(), lambda words: None)
    scenario = load_scenario(str(tmp_path / SCENARIO), "duration: 30.0")
    check_sound(compute_metrics(scenario, simulate(scenario), scenario.from_time, robot_limits(scenario)))


@pytest.mark.parametrize("name", REFUSED)
def test_a_real_robot_that_is_no_such_biped_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises((ModelError, InputError), match=REFUSED[name]):
        import_robot(place_of(name), tmp_path, Given(), lambda words: None)
