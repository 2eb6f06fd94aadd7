"""The reproduction: the paper's numbers, one page that loads nothing, data beside every figure."""

from __future__ import annotations

import csv
import html
import json
import re

import numpy as np
import pytest
from matplotlib.figure import Figure

from pdhocbf_drake.cli import main
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.studies.reproduce.calibration import (
    PAPER_DCBF,
    PAPER_PERIODIC,
    WINDOW,
    calibrate,
    measure,
    statement,
)
from pdhocbf_drake.studies.reproduce.command import chosen
from pdhocbf_drake.studies.reproduce.joints import both_legs
from pdhocbf_drake.studies.reproduce.parts import PARTS
from pdhocbf_drake.studies.reproduce.report import Number, Picture, Section, value, write_report
from pdhocbf_drake.studies.shared.cases import DCBF, PERIODIC

ROW = {"name", "paper", "ours", "unit", "tolerance", "calibrated", "command"}


@pytest.fixture(scope="module")
def logs():
    return {case: simulate(load_scenario(name)) for case, name in ((PERIODIC, "paper_vhip"), (DCBF, "paper_vhip_dcbf"))}


def test_the_calibrated_template_gives_the_papers_margins(logs):
    constant, periodic = (logs[case]["h"][WINDOW, 0].mean() for case in (DCBF, PERIODIC))
    assert abs(constant - PAPER_DCBF) <= 0.02 * PAPER_DCBF
    assert abs(periodic - PAPER_PERIODIC) <= 0.02 * PAPER_PERIODIC
    assert abs(100 * periodic / constant - 32.3) <= 1.0


def test_both_cases_are_safe_and_walk_the_same(logs):
    for log in logs.values():
        assert log["h"].min() > 0.0
        assert log.element("solver_status", "slack").max() <= 1e-9
    x = [log.element("lip_state", "x") for log in logs.values()]
    assert np.abs(x[0] - x[1]).max() < 1e-3


def test_the_calibration_gives_what_the_scenarios_hold():
    fit, scenario = calibrate(), load_scenario("paper_vhip")
    assert fit.amplitude == pytest.approx(scenario.gait.com_height_amplitude, abs=1e-4)
    assert fit.margin == pytest.approx(scenario.barriers["forward_speed"].bound.margin, abs=5e-5)
    assert fit.margin + fit.ripple == pytest.approx(PAPER_DCBF, abs=1e-5)
    assert all(word in statement(fit) for word in ("Calibrated", "chosen", "fitted"))


def test_a_higher_swing_of_the_com_flattens_the_velocity():
    ripples = [measure(amplitude)[0] for amplitude in (0.0, 0.01, 0.02)]
    assert ripples == sorted(ripples, reverse=True)


def test_only_takes_the_names_of_parts():
    assert chosen(None) == list(PARTS)
    assert chosen("fig4,fig1") == ["fig1", "fig4"]
    assert chosen("fig3") == ["fig2"]
    with pytest.raises(InputError, match=r"no part 'fig9'; there are fig1, fig2, fig4"):
        chosen("fig9")


def test_a_wrong_part_costs_one_sentence(capsys):
    assert main(["reproduce", "--only", "fig9"]) == 1
    assert capsys.readouterr().err.count("\n") == 1


def test_a_part_ends_in_a_folder_with_its_page_numbers_and_figures(tmp_path):
    place = tmp_path / "out"
    assert main(["reproduce", "--only", "theorem", "--out", str(place)]) == 0
    rows = json.loads((place / "results.json").read_text())
    assert rows
    assert all(set(row) == ROW for row in rows)
    assert sorted(p.name for p in (place / "figures").iterdir()) == ["lemma1.csv", "lemma1.png"]
    # A second time replaces it; a folder with anything else in it is left alone.
    assert main(["reproduce", "--only", "theorem", "--out", str(place)]) == 0
    (place / "mine.txt").write_text("keep")
    assert main(["reproduce", "--only", "theorem", "--out", str(place)]) == 1
    assert (place / "mine.txt").exists()


def test_the_page_loads_nothing_and_escapes_its_texts(tmp_path):
    figure = Figure()
    figure.subplots().plot([0, 1], [0, 1])
    section = Section(
        "A <title>",
        ["1 < 2"],
        [Picture("one", "a caption", figure, {"x [m]": [0, 1], "y [m]": [0, 1]})],
        numbers=[Number("n", 2.0, 2.1, "m", 0.2, True, "pdhocbf run a")],
        frames={"page": "<p>inside</p>"},
    )
    write_report({"one": section}, tmp_path, 60.0)
    page = (tmp_path / "report.html").read_text()
    assert "A &lt;title&gt;" in page
    assert "1 &lt; 2" in page
    assert html.escape("<p>inside</p>") in page
    assert all(url.startswith(("data:", "#")) for url in re.findall(r'(?:src|href)="([^"]*)"', page))
    assert not re.search(r"@import|url\(|<script|<link", page)
    assert "calibrated</span>" in page
    with (tmp_path / "figures" / "one.csv").open() as file:
        assert list(csv.reader(file)) == [["x [m]", "y [m]"], ["0", "0"], ["1", "1"]]


def test_fig_6_draws_each_joints_limits_and_the_part_that_is_used():
    time = 0.01 * np.arange(401)
    values = np.sin(time)[:, None] * np.arange(1.0, 13.0)
    limits = np.column_stack([-20.0 - np.arange(12), 30.0 + np.arange(12)])
    picture = both_legs("fig6", "angles", time, values, limits, "angle", "deg")
    curves, bars = picture.figure.axes[:2]
    assert len(curves.lines) == 6
    assert len(picture.figure.legends[0].get_texts()) == 6
    drawn = [(bar.get_y(), bar.get_y() + bar.get_height()) for bar in bars.patches]
    np.testing.assert_allclose(drawn[::2], limits[:6])
    np.testing.assert_allclose(drawn[1::2], [(v.min(), v.max()) for v in values[:, :6].T])
    assert bars.get_ylim()[0] < -31.0
    assert bars.get_ylim()[1] > 41.0  # both legs on one scale
    header, rows = picture.table()
    assert len(header) == 1 + 3 * 12
    assert rows[7][header.index("left_hip_yaw, upper limit [deg]")] == 30.0


def test_columns_of_a_picture_have_one_length():
    with pytest.raises(InputError, match="one length"):
        Picture("p", "", Figure(), {"a": [1.0], "b": [1.0, 2.0]}).table()


@pytest.mark.parametrize(
    ("paper", "ours", "tolerance", "agrees"),
    [(1.0, 1.1, 0.2, True), (1.0, 1.3, 0.2, False), (1.0, 1.0, None, None), (None, 1.0, 0.1, None)],
)
def test_agreement_is_claimed_only_where_there_is_a_tolerance(paper, ours, tolerance, agrees):
    assert Number("n", paper, ours, "1", tolerance).agrees is agrees


def test_numbers_are_shown_with_four_digits_and_none_as_a_dash():
    assert value(0.0225871) == "0.02259"
    assert value(None) == "–"
