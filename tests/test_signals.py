"""The table of signals and the picture of the diagram are of the ports that the blocks have."""

import re
import runpy
from html import unescape
from pathlib import Path

import pytest
from pydrake.systems.framework import System

from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import make_diagram
from pdhocbf_drake.systems.signals import SIGNALS, size

DOCS = Path(__file__).parents[1] / "docs"
# Blocks of Drake, whose ports have names of their own.
DRAKES = {"plant", "last_zmp", "joint_encoders", "torque_sensors", "encoder_rates", "measurement"}
WALKS = {
    "walking": "pushes: [{time: 1.0, force: [10.0, 0.0, 0.0]}]",
    "vhip": "{measurement: {delay_ticks: 1}, pushes: [{time: 1.0, force: [10.0, 0.0, 0.0]}]}",
    "walking_nobarrier": "{commands: [{time: 1.0, turn: 0.2}], whole_body: {kind: auto}}",
    "walking_dcbf": "ground: [{kind: slope, at: 1.0, length: 1.0, angle_deg: 3.0}]",
    "walking_sensors": "biped: {feels_ground: true}",
    "van_der_pol": "",
}


@pytest.fixture(scope="module")
def blocks() -> dict[str, list[System]]:
    """Every block of the diagrams of some scenarios, by its name."""
    found: dict[str, list[System]] = {}
    for scenario, text in WALKS.items():
        for block in make_diagram(load_scenario(scenario, text)).diagram.GetSystems():
            found.setdefault(block.get_name(), []).append(block)
    return found


@pytest.mark.parametrize("signal", SIGNALS, ids=lambda signal: signal.name)
def test_the_block_of_the_table_has_the_port(blocks, signal):
    ports = [block.get_output_port(i) for block in blocks[signal.system] for i in range(block.num_output_ports())]
    named = [port for port in ports if port.get_name() == signal.name]
    if signal.system in DRAKES:
        assert not named
        assert size(signal.name) in [port.size() for port in ports]
    else:
        expected = {size(signal.name, barriers=n, horizon=80, constraints=3) for n in (0, 1)}
        assert named
        assert {port.size() for port in named} <= expected


def test_the_picture_is_that_of_the_diagram():
    graph = runpy.run_path(str(DOCS / "pictures.py"))["picture"]()
    picture = (DOCS / "diagram.svg").read_text(encoding="utf-8")
    drawn = {unescape(text) for text in re.findall(r"<text[^>]*>([^<]*)</text>", picture)}
    label = re.compile(r">([\w.:()\[\] -]+)<")
    named = {text.strip() for text in label.findall(graph.to_string()) if text.strip()}
    assert len(named) > 50
    assert named <= drawn, "run python docs/pictures.py"
