"""Output that is closed, full or without some characters; pages that fail; results that Ctrl-C does not cost."""

from __future__ import annotations

import argparse
import io
import json
import os
import subprocess
import sys
from datetime import datetime as Clock
from pathlib import Path

import pytest
import synthetic
from campaigns import campaign_file
from logs import differences
from matplotlib.figure import Figure

from pdhocbf_drake.cli import main
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.run_folder import read_run
from pdhocbf_drake.studies.campaign.plan import load_campaign

RUN = synthetic.run("vhip")


class Broken(io.StringIO):
    """A stream whose reader is gone."""

    def write(self, text: str) -> int:
        raise BrokenPipeError(32, "Broken pipe")


@pytest.fixture
def simulated(monkeypatch: pytest.MonkeyPatch, elsewhere: Path) -> Path:
    """An empty folder in which `pdhocbf run vhip` ends at once."""
    monkeypatch.setattr("pdhocbf_drake.simulation.simulate.simulate", lambda *_: RUN.log)
    return elsewhere


def fail(*_: object) -> None:
    raise ValueError("no such glyph\nmore")


def command(words: str, redirection: str = "", **environment: str) -> tuple[int, str, str]:
    """Exit code, output and errors of `pdhocbf WORDS REDIRECTION` in a shell."""
    code = "import sys; from pdhocbf_drake.cli import main; sys.exit(main())"
    root = str(Path(__file__).resolve().parent.parent)
    done = subprocess.run(
        ["bash", "-c", f'exec "{sys.executable}" -c "{code}" {words} {redirection}'], capture_output=True, check=False,
        env={**os.environ, "PYTHONPATH": root, **environment}, timeout=120,
    )  # fmt: skip
    return done.returncode, done.stdout.decode("latin-1"), done.stderr.decode("latin-1")


@pytest.mark.parametrize(
    ("redirection", "code", "says"),
    [(">&-", 1, "pdhocbf: the output cannot be written: it is closed\n"), ("2>&-", 0, ""), ("<&- >&- 2>&-", 1, ""),
     (">/dev/full", 1, "pdhocbf: the output cannot be written: No space left on device\n")],
)  # fmt: skip
def test_a_command_without_output_does_its_work(redirection: str, code: int, says: str, elsewhere: Path) -> None:
    ended, _, errors = command("run vhip --out run --text 'duration: 0.5'", redirection, MPLBACKEND="nonsense")
    assert ended == code
    assert errors.endswith(says)
    assert {"Traceback", "unexpected"} & set(errors.split()) == set()
    assert len(read_run(Path("run")).log) == 51
    assert Path("run/report.html").exists()


def test_a_bound_is_written_though_nobody_reads_the_output(simulated: Path, monkeypatch, capsys) -> None:
    monkeypatch.setattr(sys, "stdout", Broken())
    assert main(["run", "vhip", "--out", "run"]) == 1
    assert Path("run/report.html").exists()
    assert capsys.readouterr().err.endswith("pdhocbf: the output cannot be written: Broken pipe\n")


def test_characters_that_a_terminal_lacks_are_marked(simulated: Path, monkeypatch, capsys) -> None:
    shown = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(shown, "latin-1"))
    monkeypatch.setattr("pdhocbf_drake.analysis.summary.summary_rows", lambda metrics: [("γ", "1 m/s²")])
    assert main(["run", "vhip", "--out", "run"]) == 0
    sys.stdout.flush()
    assert shown.getvalue().decode("latin-1").splitlines()[0].split() == ["?", "1", "m/s²"]
    assert capsys.readouterr().err.endswith("lacks some characters, which are shown as ?\n")


def test_a_page_that_fails_costs_that_page(simulated: Path, monkeypatch, capsys) -> None:
    for name, made_by, there in (
        ("replay", "products.replay", "report.html"),
        ("write_report", "report.write_report", "replay.html"),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(f"pdhocbf_drake.analysis.{made_by}", fail)
            assert main(["run", "vhip", "--out", name]) == 1
        printed = capsys.readouterr()
        missing = "replay.html" if name == "replay" else "report.html"
        assert (
            f"the run is complete, but {missing} can't be written: unexpected ValueError: no such glyph" in printed.err
        )
        assert printed.out.split()[-1] == f"{name}/{there}"
        assert Path(name, "metrics.json").exists()
        assert differences(read_run(Path(name)).log, RUN.log) == []


def test_log_and_metrics_are_in_place_before_anything_is_drawn(simulated: Path, monkeypatch) -> None:
    def look(*_: object) -> None:
        assert len(read_run(Path("run")).log) == len(RUN.log)
        assert Path("run/metrics.json").exists()

    monkeypatch.setattr("pdhocbf_drake.analysis.products.replay", look)
    monkeypatch.setattr("pdhocbf_drake.analysis.report.write_report", look)
    assert main(["run", "vhip", "--out", "run"]) == 0


def test_a_unit_is_drawn_as_it_is_where_it_is_no_formula(simulated: Path, capsys) -> None:
    for unit in (r"$\frac{$", "$m$", "$$"):
        text = json.dumps({"barriers": {"forward_speed": {"unit": unit}}})
        assert main(["run", "vhip", "--text", text, "--out", "run", "--no-replay"]) == 0, capsys.readouterr().err
        assert Path("run/figures/barriers.png").exists()


def test_runs_of_one_second_get_folders_of_their_own(simulated: Path, monkeypatch) -> None:
    from pdhocbf_drake.cli import run

    class Stopped(Clock):
        @classmethod
        def now(cls, tz=None):
            return cls(2026, 1, 2, 3, 4, 5)

    def simulate(*_: object):
        assert len(codes) + len(list(Path("runs").iterdir())) < 10
        if len(list(Path("runs").iterdir())) < 4:  # the others start before this one ends
            codes.append(main(["run", "vhip", "--no-replay"]))
        return RUN.log

    codes: list[int] = []
    monkeypatch.setattr(run, "datetime", Stopped)
    monkeypatch.setattr("pdhocbf_drake.simulation.simulate.simulate", simulate)
    assert main(["run", "vhip", "--no-replay"]) == 0
    assert codes == [0, 0, 0]
    names = sorted(path.name for path in Path("runs").iterdir())
    assert names == [f"vhip-20260102-030405{end}" for end in ("", "-2", "-3", "-4")]
    assert all(len(read_run(Path("runs", name)).log) == len(RUN.log) for name in names)


def test_a_run_that_fails_leaves_no_folder(simulated: Path, monkeypatch, capsys) -> None:
    monkeypatch.setattr("pdhocbf_drake.simulation.simulate.simulate", fail)
    assert main(["run", "vhip"]) == 1
    assert list(Path("runs").iterdir()) == []


def test_files_are_refused_before_the_work(simulated: Path, monkeypatch, capsys) -> None:
    from pdhocbf_drake.studies.bench import command as bench
    from pdhocbf_drake.studies.certify import scenario_certificate

    assert main(["run", "vhip", "--out", "run", "--no-replay"]) == 0
    Path("folder").mkdir()
    os.mkfifo("pipe")
    monkeypatch.setattr(scenario_certificate, "certify_scenario", lambda *_: pytest.fail("certified"))
    monkeypatch.setattr("pdhocbf_drake.studies.bench.benchmark.measure", lambda *_: pytest.fail("measured"))
    for place, kind in (("folder", "a folder"), ("pipe", "a pipe")):
        says = f"{place} is {kind}; the name of a file is needed"
        with pytest.raises(InputError, match=says):
            bench.run(argparse.Namespace(quick=True, json=Path(place)))
        capsys.readouterr()
        assert main(["design-bound", "run", "--margin", "0.02", "--out", place]) == 1
        assert capsys.readouterr().err == f"pdhocbf: {says}\n"


def test_ctrl_c_in_worth_keeps_the_cases_that_are_done(elsewhere: Path, monkeypatch, capsys) -> None:
    from pdhocbf_drake.studies.worth.experiments import Worth
    from pdhocbf_drake.studies.worth.results import Measures

    class Interrupted(Worth):
        def _events(self, case, gamma, scenario):
            if (case, gamma) == ("DCBF", 0.5):
                raise KeyboardInterrupt
            return [Measures("template", case, gamma, "kick", 0, 0.0, 0.0, 0.02, 0.1, 1.0, 0.03, True)]

    monkeypatch.setattr("pdhocbf_drake.studies.worth.experiments.TemplateWorth", Interrupted)
    assert main(["worth", "vhip", "--gamma", "0.2,0.5", "--workers", "1", "--out", "kept"]) == 1
    printed = capsys.readouterr()
    assert printed.err.endswith("pdhocbf: interrupted; 2 of 5 cases are kept\n")
    rows = json.loads(Path("kept/worth.json").read_text())["rows"]
    assert [(row["barrier"], row["gamma"]) for row in rows] == [("none", None), ("DCBF", 0.2)]
    assert sorted(path.name for path in Path("kept").iterdir()) == [
        "scenario.yaml", "worth.json", "worth.png", "worth.txt",
    ]  # fmt: skip


def test_a_folder_of_something_else_gets_no_results(elsewhere: Path, capsys) -> None:
    Path("scenario.yaml").write_text("# mine")
    Path("thesis.tex").write_text("years of work")
    for verb in (["worth", "vhip"], ["push", "walking"], ["certify", "vhip"], ["campaign", "vhip_pushes"]):
        assert main([*verb, "--out", "."]) == 1
        assert f"it is not a folder of {verb[0]}, since it holds " in capsys.readouterr().err
    assert Path("scenario.yaml").read_text() == "# mine"


@pytest.mark.parametrize("stop", [KeyboardInterrupt, ValueError])
def test_ctrl_c_or_an_error_in_reproduce_keeps_the_other_parts(stop, elsewhere: Path, monkeypatch, capsys) -> None:
    from pdhocbf_drake.studies.reproduce.parts import PARTS, Part
    from pdhocbf_drake.studies.reproduce.report import Number, Picture, Section

    def made(runs: object) -> Section:
        figure = Figure()
        figure.subplots().plot([0, 1], [0, 1])
        good = Picture("good", "a caption", figure, {"x": [0, 1]})
        bad = Picture("bad", "a caption", figure, {"x": [0, 1], "y": [0]})
        return Section("Made", pictures=[bad, good], numbers=[Number("n", 2.0, 2.0, "m", 0.0)])

    def broken(runs: object) -> Section:
        raise stop("no such walk")

    monkeypatch.setitem(PARTS, "fig1", Part(made))
    monkeypatch.setitem(PARTS, "fig2", Part(broken))
    assert main(["reproduce", "--only", "fig1,fig2", "--out", "kept"]) == 1
    assert "1 of 2 parts are in kept; what is missing is fig2" in capsys.readouterr().err
    assert sorted(path.name for path in Path("kept/figures").iterdir()) == ["good.csv", "good.png"]
    assert json.loads(Path("kept/results.json").read_text())[0]["name"] == "n"
    assert "<td>yes, exactly</td>" in Path("kept/report.html").read_text()


@pytest.mark.parametrize(
    "changes",
    [{"factors": {"friction": {"low": 0.1, "high": 0.9, "points": 10**9}}},
     {"factors": {"friction": {"values": [0.5]}}, "repeats": 10**9}],
)  # fmt: skip
def test_a_campaign_without_end_is_refused_at_once(changes: dict, tmp_path: Path) -> None:
    for wrong, runs in (({"runs": 10**9}, 10**9), ({"runs": None, "sample": "grid", **changes}, 2 * 10**9)):
        with pytest.raises(InputError, match=f"at most 100000 runs are possible, given {runs}"):
            load_campaign(str(campaign_file(tmp_path, **wrong)))


def test_a_campaign_deletes_its_own_parts_alone(tmp_path: Path) -> None:
    from pdhocbf_drake.studies.campaign.plan import plan_runs
    from pdhocbf_drake.studies.campaign.store import CampaignStore, locked

    (tmp_path / "thesis.tex").write_text("years of work")
    (tmp_path / "out" / "parts").mkdir(parents=True)
    (tmp_path / "out" / ".lock").symlink_to(tmp_path / "thesis.tex")
    (tmp_path / "out" / "parts" / ".probe").symlink_to(tmp_path / "thesis.tex")
    (tmp_path / "out" / "parts" / "run.step").write_text("years of work")
    config, path = load_campaign(str(campaign_file(tmp_path)))
    CampaignStore(tmp_path / "out", plan_runs(config, path.parent)).consolidate()
    assert sorted(path.name for path in (tmp_path / "out" / "parts").iterdir()) == [".probe", "run.step"]
    with pytest.raises(OSError, match=r"since it holds parts/\.probe"), locked(tmp_path / "out"):
        pytest.fail("the campaign must not start")
    assert (tmp_path / "thesis.tex").read_text() == "years of work"
