"""What a run says of its pushes is what its plant had of them, and nothing where there are none."""

from __future__ import annotations

import numpy as np
import pytest
import synthetic

from pdhocbf_drake.analysis.figures import make_figures
from pdhocbf_drake.analysis.pushes import push_rows, pushes_of, spans_of
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate

AHEAD = {"time": 2.5, "force": [40.0, 0.0, 0.0]}


def _said(*pushes: dict[str, object], system: str = "biped", **keys: object) -> dict[str, str]:
    return dict(push_rows(synthetic.pushed(synthetic.run(system), *pushes, **keys)))


def test_spans_and_impulses_are_those_of_the_log() -> None:
    pushes = "[{step: 0, phase: 7, force: [3, -4, 0]}, {time: 0.2, duration: 0.05, force: [0, 5, 0]}]"
    scenario = load_scenario("vhip", f"{{duration: 1.0, pushes: {pushes}}}")
    run = Run.of(scenario, simulate(scenario))
    forces, found = run.log["push"], pushes_of(run)
    # A row has what acted in the tick before it.
    inside = [(run.log.time > start + 1e-9) & (run.log.time < end + 1e-9) for start, end in spans_of(run)]
    assert found == sorted(found, key=lambda push: push.span)
    assert np.array_equal(np.any(forces != 0.0, axis=1), np.any(inside, axis=0))
    for push, rows in zip(found, inside, strict=True):
        assert push.impulse == pytest.approx(scenario.tick * forces[rows].sum(axis=0))


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({}, "4 N s forward at 2.5 s"),
        ({"force": [0, -35, 0], "body": "left_foot"}, "3.5 N s right on left_foot at 2.5 s"),
        ({"force": [-30, 40, 0]}, "5 N s (3 backward, 4 left) at 2.5 s"),
        ({"time": 3.95}, "2 N s forward at 3.95 s"),  # the run ends at 4 s
        ({"time": None, "step": 3, "phase": 10}, "4 N s forward at 2.1 s"),
    ],
)
def test_a_push_is_said_by_impulse_direction_and_time(keys: dict[str, object], said: str) -> None:
    assert _said(AHEAD | keys) == {"pushed": said}


def test_directions_of_a_walk_that_turns_are_those_of_the_world() -> None:
    assert _said(AHEAD, start={"yaw": 1.0})["pushed"] == "4 N s in +x at 2.5 s"


def test_three_are_named_and_the_wind_is_said_too() -> None:
    said = _said(*(AHEAD | {"time": 0.5 * i} for i in range(6)), wind=[0.0, -8.0])
    assert said["pushed"].endswith("; 4 N s forward at 1 s, and 3 more")
    assert said["wind"] == "8 N right"


def test_a_run_without_pushes_says_nothing() -> None:
    assert _said() == _said(AHEAD | {"time": 4.0}) == _said(AHEAD | {"force": [0, 0, 0]}) == {}
    assert _said(AHEAD, system="van_der_pol", wind=[1.0, 0.0]) == {}


def test_figures_over_time_mark_each_push_with_one_entry_of_the_legend() -> None:
    run = synthetic.run("vhip")
    marked = synthetic.pushed(run, AHEAD, AHEAD | {"time": 1.0})
    entries = {}
    for drawn in make_figures(marked, None):
        legend = drawn.figure.axes[0].get_legend()
        assert legend is not None
        entries[drawn.name] = [text.get_text() for text in legend.get_texts()].count("push")
    assert entries == {"velocity": 1, "velocity_steady": 1, "barriers": 1, "com_zmp": 1, "footsteps": 0, "solver": 1}
    before = {drawn.name: len(drawn.figure.axes[0].patches) for drawn in make_figures(run, None)}
    after = {drawn.name: len(drawn.figure.axes[0].patches) for drawn in make_figures(marked, None)}
    more = {name: after[name] - number for name, number in before.items()}
    assert more == {**dict.fromkeys(before, 2), "velocity_steady": 1, "footsteps": 0}
