"""Figures can be read: units on every axis, legends that name each line, one colour a quantity."""

from __future__ import annotations

import base64
import gc
import html
import itertools
import re

import matplotlib
import numpy as np
import pytest
import synthetic
from matplotlib.figure import Figure

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.figures import figures_of, make_figures, rendered, write_pictures
from pdhocbf_drake.analysis.figures_walk import footsteps, quantities
from pdhocbf_drake.analysis.report import ReportedRun, metrics_of, report_pieces, write_report
from pdhocbf_drake.analysis.robot_limits import robot_limits
from pdhocbf_drake.collecting import without_garbage_collection
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate

EXPECTED = {
    "biped": [
        "velocity",
        "velocity_steady",
        "barriers",
        "com_zmp",
        "footsteps",
        "solver",
        "tracking",
        "joints",
        "torques",
    ],
    "vhip": ["velocity", "velocity_steady", "barriers", "com_zmp", "footsteps", "solver"],
    "van_der_pol": ["tubes", "phase", "barriers"],
}


@pytest.fixture(params=EXPECTED, scope="module")
def figures(request):
    run = synthetic.run(request.param, duration=3.0)
    drawn = make_figures(run, robot_limits(run.scenario))
    assert [one.name for one in drawn] == EXPECTED[request.param]
    return drawn


def test_every_axis_has_a_quantity_and_a_unit(figures):
    for drawn in figures:
        axes = drawn.figure.axes
        for axis in axes:
            assert re.fullmatch(r".+ \[.+\]", axis.get_ylabel()), drawn.name
        assert re.fullmatch(r".+ \[.+\]", axes[-1].get_xlabel()), drawn.name


def test_every_figure_has_a_legend_and_a_caption(figures):
    for drawn in figures:
        assert any(axis.get_legend() for axis in drawn.figure.axes), drawn.name
        assert drawn.caption


def test_figures_of_a_run_are_freed_one_by_one():
    run = synthetic.run("vhip", duration=3.0)
    kept, alive = {id(each) for each in _figures()}, []

    def watched():
        made = figures_of(run, None)
        while figure := next(made, None):
            yield [figure, figure := None][0]
            alive.append(sum(id(each) not in kept for each in _figures()))

    with without_garbage_collection():
        pictures = rendered(watched())
    assert [picture.name for picture in pictures] == EXPECTED["vhip"]
    assert alive == [0] * len(pictures)


def _figures():
    return [each for each in gc.get_objects() if issubclass(type(each), Figure)]


def test_a_replay_is_written_piece_by_piece_and_can_be_read_as_a_whole():
    run = synthetic.run("vhip", duration=1.0)
    replay = '<p title="1 < 2 & 3">' * 120_000
    pieces = list(report_pieces([ReportedRun(run, metrics_of(run), [], replay)]))
    assert max(map(len, pieces)) < len(replay)  # escaped, it is twice as long
    assert f'srcdoc="{html.escape(replay).replace("&quot;", "&#34;")}"' in "".join(pieces)


def test_figures_are_written_and_not_blank(figures, tmp_path):
    write_pictures(rendered(figures), tmp_path / "figures")
    for drawn in figures:
        picture = matplotlib.image.imread(tmp_path / "figures" / f"{drawn.name}.png")
        inked = np.abs(picture[:, :, :3] - 1.0).max(axis=2) > 0.1
        assert 0.005 < inked.mean() < 0.6, drawn.name


def test_the_report_shows_the_pictures_of_the_folder_each_rendered_once(tmp_path, monkeypatch):
    times = []
    draw = Figure.draw
    monkeypatch.setattr(Figure, "draw", lambda self, *a, **k: (times.append(id(self)), draw(self, *a, **k))[1])
    run = synthetic.run("biped", duration=3.0)
    write_report(run, metrics_of(run), tmp_path, None)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    shown = [base64.b64decode(image) for image in re.findall(r"data:image/png;base64,([^\"]+)", page)]
    kept = [path.read_bytes() for path in (tmp_path / "figures").iterdir()]
    assert sorted(shown) == sorted(kept)
    assert len(times) == len(shown) == len(EXPECTED["biped"])


def test_measured_and_planned_differ_in_colour_and_style():
    run = synthetic.run("vhip")
    velocity = next(drawn for drawn in make_figures(run, None) if drawn.name == "velocity")
    lines = {line.get_label(): line for line in velocity.figure.axes[0].lines}
    assert lines["measured"].get_color() == palette.MEASURED_COM
    assert lines["measured"].get_linestyle() == "-"
    assert lines["planned"].get_color() == palette.PLANNED_COM
    assert lines["planned"].get_linestyle() == "--"


def test_there_is_a_panel_for_each_bounded_quantity():
    run = synthetic.run("vhip")
    config = run.scenario.barriers["forward_speed"]
    barriers = {"sideways": config.model_copy(update={"axis": "y"}), "ahead": config}
    two = run._replace(scenario=run.scenario.model_copy(update={"barriers": barriers}))
    for name in ("h", "barrier_bound"):
        two.log.signals[name] = np.hstack([two.log[name], two.log[name]])
    velocity = next(drawn for drawn in make_figures(two, None) if drawn.name == "velocity")
    labels = [axes.get_ylabel() for axes in velocity.figure.axes]
    assert labels == ["CoM velocity in x [m/s]", "CoM velocity in y [m/s]"]
    bounds = [[line.get_label() for line in axes.lines][2:] for axes in velocity.figure.axes]
    assert bounds == [["bound of ahead"], ["bound of sideways"]]


def test_figures_leave_a_users_settings_alone():
    with matplotlib.rc_context({"font.size": 17.0}):
        make_figures(synthetic.run("van_der_pol"), None)
        assert matplotlib.rcParams["font.size"] == 17.0


def test_a_log_without_motion_has_no_figures():
    run = synthetic.run("vhip")
    assert make_figures(run._replace(log=run.log.after(4.0)), None) == []


# Machado, Oliveira and Fernandes (2009), severity 1: what a dichromat sees, in linear RGB.
_DEUTERANOPIA = [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
_PROTANOPIA = [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]


def _seen(colour: str, by) -> np.ndarray:
    srgb = np.array(palette.rgb(colour))
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return np.clip(np.array(by) @ linear, 0.0, 1.0) ** (1 / 2.2)


@pytest.mark.parametrize("by", [np.eye(3), _DEUTERANOPIA, _PROTANOPIA], ids=["all cones", "no green", "no red"])
@pytest.mark.parametrize(
    "together",
    [
        (palette.SAFE, palette.UNSAFE),
        (palette.LEFT, palette.RIGHT),
        (palette.MEASURED_COM, palette.MEASURED_ZMP, palette.PLANNED_COM, palette.PLANNED_ZMP),
        (palette.MEASURED_COM, palette.PLANNED_COM, palette.BARRIERS[0], palette.BARRIERS[1]),
        palette.RUNS[:4],
        (palette.MEASURED_COM, *palette.CASES.values()),
    ],
)
def test_colours_that_meet_stay_apart_for_the_colour_blind(together, by):
    for one, other in itertools.combinations(together, 2):
        assert np.linalg.norm(_seen(one, by) - _seen(other, by)) > 0.15, (one, other)


def test_the_safety_colour_runs_from_red_to_green():
    assert palette.safety_colour(-1.0, 0.1) == palette.safety_colour(0.0, 0.1) == palette.rgb(palette.UNSAFE)
    assert palette.safety_colour(0.1, 0.1) == palette.safety_colour(5.0, 0.1) == palette.rgb(palette.SAFE)
    red, green = zip(*(palette.safety_colour(h, 0.1)[:2] for h in np.linspace(0.0, 0.1, 9)), strict=True)
    assert list(red) == sorted(red, reverse=True)
    assert list(green) == sorted(green)


def test_a_walk_on_command_is_drawn_along_its_heading_and_on_the_ground_that_it_needs() -> None:
    def drawn(commands: str) -> Run:
        scenario = load_scenario("vhip", f"{{duration: 4.0{commands}}}")
        return Run.of(scenario, simulate(scenario))

    straight, turning = drawn(""), drawn(", commands: [{time: 0, velocity: [0.3, 0], turn: 0.75}]")
    assert quantities(straight).axes[0].get_ylabel() == "CoM velocity in x [m/s]"
    assert quantities(turning).axes[0].get_ylabel() == "CoM velocity along the heading [m/s]"
    low, high = (footsteps(run, None).get_size_inches()[1] for run in (straight, turning))
    assert low < high
