"""A scenario takes from its robot what it does not say itself."""

from pathlib import Path

import yaml

from pdhocbf_drake.biped import models_folder
from pdhocbf_drake.simulation.scenario_file import load_scenario


def test_height_and_width_come_from_the_robot_unless_the_scenario_says_them(tmp_path: Path) -> None:
    source = models_folder() / "biped"
    robot = yaml.safe_load((source / "biped.yaml").read_text(encoding="utf-8"))
    robot |= {"model": str(source / robot["model"]), "packages": {"pdhocbf_models": str(source.parent)}}
    robot |= {"com_height": 0.57, "stance_width": 0.18}
    (tmp_path / "wide.yaml").write_text(yaml.safe_dump(robot), encoding="utf-8")
    text = f"{{robot: {tmp_path / 'wide.yaml'}}}"
    gait = load_scenario("walking", text).gait
    assert (gait.com_height, gait.stance_width) == (0.57, 0.18)
    text = f"{{robot: {tmp_path / 'wide.yaml'}, gait: {{stance_width: 0.17}}}}"
    gait = load_scenario("walking", text).gait
    assert (gait.com_height, gait.stance_width) == (0.57, 0.17)


def test_the_template_needs_no_robot() -> None:
    assert load_scenario("vhip", "{robot: nobody}").robot == "nobody"
