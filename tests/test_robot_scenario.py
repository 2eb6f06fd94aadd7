"""What a scenario takes from its robot, and what makes no difference: the motors' order, the plant's step."""

import re
import shutil
from pathlib import Path

import numpy as np
import yaml

from pdhocbf_drake.analysis.metrics import compute_metrics
from pdhocbf_drake.robot import Biped, models_folder
from pdhocbf_drake.simulation.drake_config import plant_config
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate


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


def test_a_robot_whose_motors_come_in_another_order_walks_all_the_same(tmp_path: Path) -> None:
    folder = tmp_path / "models" / "biped"
    shutil.copytree(models_folder() / "biped", folder)
    (model,) = folder.glob("*.urdf")
    urdf = model.read_text(encoding="utf-8")
    motors = re.findall(r" *<transmission .*?</transmission>\n", urdf, re.DOTALL)
    for motor in motors:
        urdf = urdf.replace(motor, "")
    model.write_text(urdf.replace("</robot>", "".join(reversed(motors)) + "</robot>"), encoding="utf-8")
    turned = load_scenario("walking", f"{{robot: {folder / 'biped.yaml'}, duration: 1.6}}")
    assert Biped.load(turned.robot).u_index.tolist() == list(range(11, -1, -1))
    log, other = simulate(load_scenario("walking", "duration: 1.6")), simulate(turned)
    np.testing.assert_allclose(other["robot_state"], log["robot_state"], atol=1e-6)
    np.testing.assert_allclose(other["actuation"], log["actuation"], atol=1e-3)


def test_at_five_times_the_plants_step_the_walk_is_the_same() -> None:
    text = "{duration: 4.0, plant: {time_step: %s}}"
    fine, coarse = (load_scenario("walking", text % step) for step in (0.001, 0.005))
    first, other = (compute_metrics(scenario, simulate(scenario), 1.0, None) for scenario in (fine, coarse))
    assert set(other.mpc.degraded) == set()
    assert other.mpc.fallbacks == 0
    assert abs(other.mean_speed - first.mean_speed) < 0.002
    assert other.barriers["forward_speed"].h_min > 0.9 * first.barriers["forward_speed"].h_min > 0.0
    assert all(b < a + 0.005 for a, b in zip(first.com_rms_error, other.com_rms_error, strict=True))


def test_contact_is_not_softened_by_default() -> None:
    assert plant_config({}).sap_near_rigid_threshold == 0.0
    assert plant_config({"sap_near_rigid_threshold": 1.0}).sap_near_rigid_threshold == 1.0
