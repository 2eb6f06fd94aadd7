"""What a simulation leaves behind: its log, and no diagram, block or plant."""

from __future__ import annotations

import gc
import importlib
import pkgutil
import weakref

import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, LeafSystem, System

from pdhocbf_drake import systems as blocks
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import make_diagram, simulate
from pdhocbf_drake.simulation.wiring import Form
from pdhocbf_drake.systems.block import Block

EVERYTHING = """{
    duration: 0.3, model_error: {torso_mass: 1.1}, pushes: [{time: 0.1, force: [10, 0, 0]}],
    measurement: {delay_ticks: 1, noise: {com: 0.001}}, commands: [{time: 0, velocity: [0.2, 0], turn: 0.2}],
}"""
RUNS = [
    ("walking", "duration: 0.1"), ("walking", EVERYTHING), ("vhip", "duration: 0.3"),
    ("vhip", "{duration: 0.3, commands: [{time: 0, velocity: [0.2, 0]}], pushes: [{time: 0.1, force: [5, 0, 0]}]}"),
    ("van_der_pol", "duration: 0.1"), ("walking_sensors", "{duration: 0.3, pushes: [{time: 0.1, force: [10, 0, 0]}]}"),
]  # fmt: skip


def systems() -> list[System]:
    # by its type: to ask a weak proxy of what is gone for its class raises
    return [found for found in gc.get_objects() if issubclass(type(found), (LeafSystem, Diagram))]


def kinds(base: type) -> set[type]:
    return {base}.union(*map(kinds, base.__subclasses__()))


def test_every_block_is_one_that_can_be_freed() -> None:
    for module in pkgutil.iter_modules(blocks.__path__, f"{blocks.__name__}."):
        importlib.import_module(module.name)
    ours = {kind for kind in kinds(LeafSystem) if kind.__module__.startswith("pdhocbf_drake.")}
    assert ours <= kinds(Block)
    assert len(ours) > 10


@pytest.mark.parametrize("form", ["fused", "blocks"])
@pytest.mark.parametrize(("name", "text"), RUNS)
def test_a_run_leaves_no_system_behind(name: str, text: str, form: Form) -> None:
    scenario = load_scenario(name, text)
    before = {id(system) for system in systems()}
    log = simulate(scenario, form=form)
    left = [type(system).__name__ for system in systems() if id(system) not in before]
    assert len(log) > 10
    assert left == []


@pytest.mark.parametrize("form", ["fused", "blocks"])
@pytest.mark.parametrize(("name", "text"), RUNS)
def test_a_diagram_lives_as_long_as_its_simulator(name: str, text: str, form: Form) -> None:
    simulator = Simulator(make_diagram(load_scenario(name, text), form=form).diagram)
    gc.collect()
    simulator.AdvanceTo(0.1)  # every block is called
    assert simulator.get_context().get_time() == 0.1
    diagram = weakref.ref(simulator.get_system())
    del simulator
    gc.collect()
    assert diagram() is None
