"""The command line from end to end: files, printed text and exit codes."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import synthetic
from logs import differences

from pdhocbf_drake.analysis.report import write_metrics
from pdhocbf_drake.cli import main
from pdhocbf_drake.simulation.run_folder import new_run_folder, read_run

SHORT = "duration: 1.0"


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory) -> Path:
    """A short real run of the template."""
    place = tmp_path_factory.mktemp("runs") / "vhip"
    assert main(["run", "vhip", "--text", SHORT, "--out", str(place)]) == 0
    return place


def synthetic_folder(place: Path, **kwargs) -> Path:
    with new_run_folder(place) as folder:
        synthetic.run("vhip", **kwargs).save(folder)
    return place


def test_list_names_every_scenario_with_its_sentence(capsys):
    assert main(["list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) >= 7
    assert all(len(line.split(maxsplit=1)[1]) > 20 for line in lines)


def test_a_run_leaves_the_promised_folder(run_folder):
    names = {entry.name for entry in run_folder.iterdir()}
    assert names == {
        "scenario.yaml", "provenance.json", "log.npz", "metrics.json", "replay.html", "report.html", "figures",
    }  # fmt: skip
    metrics = json.loads((run_folder / "metrics.json").read_text())
    assert metrics["scenario"] == "vhip"
    assert metrics["ending"] == "finished"
    assert metrics["template"]
    assert metrics["simulated_seconds"] == pytest.approx(1.0)
    assert {p.suffix for p in (run_folder / "figures").iterdir()} == {".png"}
    assert [entry.name for entry in run_folder.parent.iterdir()] == ["vhip"]


@pytest.mark.parametrize("words", [["list"], ["run", "nowhere.yaml"], ["walk"]])
def test_the_package_run_as_a_module_is_the_same_command(words, elsewhere):
    """Output, errors and exit code, of what works, of what is refused and of wrong usage."""
    script = "import sys; from pdhocbf_drake.cli import main; sys.exit(main())"
    ways = ["-m", "pdhocbf_drake"], ["-c", script]
    module, command = (
        subprocess.run([sys.executable, *way, *words], capture_output=True, text=True, check=False) for way in ways
    )
    assert module.returncode == {"list": 0, "run": 1, "walk": 2}[words[0]]
    assert (module.returncode, module.stdout, module.stderr) == (command.returncode, command.stdout, command.stderr)


def test_a_runs_own_scenario_runs_again_bit_for_bit(run_folder, tmp_path):
    place = tmp_path / "again"
    assert main(["run", str(run_folder / "scenario.yaml"), "--out", str(place), "--no-replay"]) == 0
    assert differences(read_run(place).log, read_run(run_folder).log) == []
    assert not (place / "replay.html").exists()
    assert (place / "report.html").exists()


def test_the_summary_ends_with_replay_and_report(elsewhere, capsys):
    assert main(["run", "vhip", "--text", SHORT]) == 0
    printed = capsys.readouterr()
    place = next((elsewhere / "runs").iterdir()).relative_to(elsewhere)
    assert place.name.startswith("vhip-")
    ends = [line.split()[-1] for line in printed.out.splitlines()[-2:]]
    assert ends == [str(place / "replay.html"), str(place / "report.html")]
    assert "vhip: 1.0 of 1.0 s simulated in" in printed.err
    assert printed.err.splitlines()[-1] == "vhip: drawing the report and the replay"
    assert "\r" not in printed.err


def test_a_bar_on_a_terminal_and_lines_elsewhere(monkeypatch, capsys):
    from pdhocbf_drake.terminal import shown_progress

    with shown_progress("walk", 2.0, "s simulated") as progress:
        for tenth in range(1, 21):
            progress(tenth / 10)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 10
    assert lines[-1].startswith("walk: 2.0 of 2.0 s")
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    with shown_progress("walk", 2.0, "s simulated") as progress:
        progress(1.0)
        progress(2.0)
    assert "100%|" in capsys.readouterr().err


def test_replay_and_report_are_rebuilt_from_the_log(tmp_path, capsys):
    place = synthetic_folder(tmp_path / "run")
    assert main(["replay", str(place)]) == 0
    assert main(["report", str(place)]) == 0
    assert capsys.readouterr().out.split() == [str(place / "replay.html"), str(place / "report.html")]
    assert (place / "metrics.json").exists()
    assert (place / "figures" / "velocity.png").exists()
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["run"]


def test_one_report_for_several_runs(elsewhere, capsys):
    folders = [str(synthetic_folder(elsewhere / name, duration=2.5)) for name in ("one", "two")]
    assert main(["report", *folders]) == 0
    page = (elsewhere / "comparison.html").read_text()
    assert page.count("<iframe") == 2
    assert "synthetic (1)" in page
    assert "synthetic (2)" in page
    assert main(["report", *folders, "--out", str(elsewhere)]) == 1
    assert "must be the name of a file" in capsys.readouterr().err


def test_compare_prints_both_margins_and_their_ratio(tmp_path, capsys):
    folders = [str(synthetic_folder(tmp_path / name)) for name in ("one", "two")]
    assert main(["compare", *folders]) == 0
    printed = capsys.readouterr().out
    assert printed.count("mean h 0.02 m/s from 2 s on") == 2
    assert "M = 100.0 %" in printed
    assert main(["compare", *folders, "--from-time", "50"]) == 1
    assert f"{folders[0]} has less than a period of 0.4 s from 50 s on: it ended at 4.00 s" in capsys.readouterr().err


def test_compare_begins_where_the_first_runs_scenario_does(tmp_path, capsys):
    for name, start in (("early", 1.25), ("late", 2.01)):
        run = synthetic.run("vhip")
        with new_run_folder(tmp_path / name) as folder:
            run._replace(scenario=run.scenario.model_copy(update={"from_time": start})).save(folder)
    for first, second, start in (("early", "late", "1.25"), ("late", "early", "2.01")):
        assert main(["compare", str(tmp_path / first), str(tmp_path / second)]) == 0
        assert capsys.readouterr().out.count(f"m/s from {start} s on") == 2


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["run", "wlaking"], "unknown scenario 'wlaking'; there are "),
        (["run", "nowhere.yaml"], "nowhere.yaml does not exist"),
        (["run", "vhip", "--text", "gaitt: {}"], "vhip.gaitt: unknown key; allowed here: barrier_changes"),
        (["run", "vhip", "--text", "gait: {stride: .nan}"], "vhip.gait.stride: must be a finite number"),
        (["run", "vhip", "--text", "gait: {zmp_box: [0.1]}"], "vhip.gait.zmp_box"),
        (["run", "vhip", "--text", "gait: {tick: -0.01}"], "vhip.gait.tick: must be from 0.0001 to 0.1 s"),
        (["run", "vhip", "--text", "mpc: {horizon: 70}"], "Lemma 2"),
        (["run", "vhip", "--text", "barriers: {forward_speed: {gamma: [1.5, 0.5]}}"], "gamma"),
        (["run", "vhip", "--text", "barriers: {forward_speed: {relative_degree: 1}}"], "relative degree"),
        (["run", "walking", "--text", "robot: nao"], "no robot 'nao'"),
        (["run", "walking", "--text", "gait: {com_height: 0.9}"], "CoM"),
        (["run", "walking", "--text", "gait: {stride: 1.5}"], "stride"),
        (["run", "walking", "--text", "gait: {zmp_box: [0.4, 0.4]}"], "sole"),
        (["compare", "nowhere", "nowhere"], "nowhere is not a run folder: there is no such folder"),
        (["replay", "."], "is not a run folder: it has no scenario.yaml"),
        (["report", "nowhere"], "there is no such folder"),
    ],
)
def test_bad_input_is_one_sentence_and_leaves_nothing(arguments, says, elsewhere, capsys):
    assert main(arguments) == 1
    printed = capsys.readouterr()
    assert says in printed.err
    assert printed.err.startswith("pdhocbf: ")
    assert printed.err.count("\n") == 1
    assert "Traceback" not in printed.err
    assert printed.out == ""
    assert [entry for entry in elsewhere.rglob("*") if entry.is_file()] == []


def test_a_place_that_is_no_run_folder_is_refused_before_anything_runs(elsewhere, capsys):
    (elsewhere / "thesis.tex").write_text("years of work")
    assert main(["run", "vhip", "--out", str(elsewhere)]) == 1
    assert "not a run folder, since it holds thesis.tex" in capsys.readouterr().err
    assert [entry.name for entry in elsewhere.iterdir()] == ["thesis.tex"]


@pytest.mark.parametrize("words", [["run", "vhip", "--bogus"], ["report", "a", "--bogus"], ["list", "--bogus"]])
def test_an_unknown_option_is_an_error_with_the_usage_of_its_verb(words, capsys):
    with pytest.raises(SystemExit) as ended:
        main(words)
    printed = capsys.readouterr().err
    assert ended.value.code == 2
    assert printed.startswith(f"usage: pdhocbf {words[0]} ")
    assert "unknown here: --bogus" in printed


@pytest.mark.parametrize("words", [["compare", "a", "b"], ["design-bound", "a", "--margin", "0"]])
def test_the_error_for_a_wrong_time_names_no_function(words, capsys):
    with pytest.raises(SystemExit):
        main([*words, "--from-time", "abc"])
    assert "a time from 0 s on is needed, given abc" in capsys.readouterr().err


def test_drake_ending_the_process_is_an_error_like_others(monkeypatch, elsewhere, capsys):
    def ended(*_):
        raise SystemExit("Failure at x.cc:15 in f(): condition 'time_step > 0' failed.\nmore")

    monkeypatch.setattr("pdhocbf_drake.simulation.simulate.simulate", ended)
    assert main(["run", "vhip"]) == 1
    message = "Drake refuses something in this: Failure at x.cc:15 in f(): condition 'time_step > 0' failed."
    assert capsys.readouterr().err == f"pdhocbf: {message}\n"
    assert [entry for entry in elsewhere.rglob("*") if entry.is_file()] == []


@pytest.mark.parametrize(
    ("ending", "code"), [("finished", 0), ("fell", 3), ("failed: NaN in the plant", 3), ("interrupted", 1)]
)
def test_the_exit_code_says_how_a_run_ended_and_the_run_is_kept(ending, code, monkeypatch, tmp_path, capsys):
    from pdhocbf_drake.cli import run

    recorded = synthetic.run("vhip", ending=ending)
    monkeypatch.setattr("pdhocbf_drake.simulation.simulate.simulate", lambda *_: recorded.log)
    monkeypatch.setattr(run, "write_pages", lambda *_: ([], ""))
    assert main(["run", "vhip", "--out", str(tmp_path / "run")]) == code
    assert ("what was recorded is in" in capsys.readouterr().err) == (code != 0)
    assert read_run(tmp_path / "run").log.ending == ending


def test_a_full_disk_costs_the_pages_and_not_the_run(monkeypatch, tmp_path, capsys):
    def full(recorded, place):
        raise OSError(errno.ENOSPC, "No space left on device", str(place))

    recorded = synthetic.run("vhip")
    monkeypatch.setattr("pdhocbf_drake.simulation.simulate.simulate", lambda *_: recorded.log)
    monkeypatch.setattr("pdhocbf_drake.analysis.products.replay", full)
    place = tmp_path / "run"
    assert main(["run", "vhip", "--out", str(place)]) == 1
    printed = capsys.readouterr()
    assert f"run folder  {place}".split() == printed.out.splitlines()[-1].split()
    assert printed.err == (
        "vhip: drawing the report and the replay\n"
        "pdhocbf: the run is complete, but replay.html can't be written: No space left on device; "
        f"`pdhocbf report {place}` makes up what is missing\n"
    )
    assert differences(read_run(place).log, recorded.log) == []
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_a_disk_too_full_for_the_log_is_an_error_with_the_given_place(monkeypatch, tmp_path, capsys):
    from pdhocbf_drake.simulation.run_log import RunLog

    def full(self, path):
        raise OSError(errno.ENOSPC, "No space left on device")

    recorded = synthetic.run("vhip")
    monkeypatch.setattr("pdhocbf_drake.simulation.simulate.simulate", lambda *_: recorded.log)
    monkeypatch.setattr(RunLog, "save", full)
    assert main(["run", "vhip", "--out", str(tmp_path / "run")]) == 1
    assert capsys.readouterr().err == f"pdhocbf: {tmp_path}/run cannot be written: No space left on device\n"
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_while_drake_is_being_imported_is_no_traceback(monkeypatch, capsys):
    import importlib

    def interrupted(name):
        os.kill(os.getpid(), signal.SIGINT)
        return real(name)

    real = importlib.import_module
    monkeypatch.setattr(importlib, "import_module", interrupted)
    assert main(["run", "vhip"]) == 1
    assert capsys.readouterr().err == "pdhocbf: interrupted; nothing was written\n"


@pytest.mark.parametrize("arguments", [[], ["walk"], ["run"], ["run", "vhip", "--oot", "x"], ["compare", "one"]])
def test_wrong_usage_is_two(arguments, capsys):
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert "usage: pdhocbf" in capsys.readouterr().err


def test_the_unexpected_is_one_line_too(monkeypatch, elsewhere, capsys):
    def broken(*_):
        raise RuntimeError("first line\nsecond line")

    monkeypatch.setattr("pdhocbf_drake.simulation.simulate.simulate", broken)
    assert main(["run", "vhip"]) == 1
    assert capsys.readouterr().err == (
        "pdhocbf: unexpected RuntimeError: first line (set PDHOCBF_DEBUG=1 to see where)\n"
    )
    assert [entry for entry in elsewhere.rglob("*") if entry.is_file()] == []
    monkeypatch.setenv("PDHOCBF_DEBUG", "1")
    with pytest.raises(RuntimeError):
        main(["run", "vhip"])


def test_an_oscillator_cannot_be_watched_live(elsewhere, capsys):
    assert main(["run", "van_der_pol", "--meshcat"]) == 1
    assert "--meshcat: walks can be watched live" in capsys.readouterr().err
    assert [entry for entry in elsewhere.rglob("*") if entry.is_file()] == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_ctrl_c_leaves_a_marked_partial_run(number, tmp_path):
    # Under nohup SIGHUP is ignored, which a child inherits.
    command = "import signal, sys; signal.signal(signal.SIGHUP, signal.SIG_DFL); from pdhocbf_drake.cli import main; "
    command += "sys.exit(main())"
    arguments = ["run", "vhip", "--text", "duration: 60.0", "--out", str(tmp_path / "run")]
    root = Path(__file__).resolve().parent.parent
    environment = {**os.environ, "PYTHONPATH": str(root)}
    with subprocess.Popen(
        [sys.executable, "-u", "-c", command, *arguments], stderr=subprocess.PIPE, text=True, env=environment
    ) as process:
        assert process.stderr is not None
        assert any("6.0 of 60.0 s" in line for line in process.stderr)  # a slow machine says more before
        process.send_signal(number)
        _, printed = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "interrupted; what was recorded is in" in printed
    assert "Traceback" not in printed
    run = read_run(tmp_path / "run")
    assert run.log.ending == "interrupted"
    assert 5.9 <= run.log.time[-1] < 60.0
    metrics = json.loads((tmp_path / "run" / "metrics.json").read_text())
    assert metrics["ending"] == "interrupted"
    assert metrics["fell"] is False
    assert [entry.name for entry in tmp_path.iterdir()] == ["run"]


@pytest.mark.parametrize(("sink", "says"), [("| true", ""), ("> /dev/full", "the output cannot be written: No space")])
def test_output_that_goes_nowhere_is_no_traceback(sink, says):
    command = "import sys; from pdhocbf_drake.cli import main; sys.exit(main(['list']))"
    root = Path(__file__).resolve().parent.parent
    done = subprocess.run(
        ["bash", "-c", f'{sys.executable} -c "{command}" {sink}'],
        capture_output=True, text=True, env={**os.environ, "PYTHONPATH": str(root)}, timeout=60, check=False,
    )  # fmt: skip
    assert says in done.stderr
    assert not any(word in done.stderr for word in ("Traceback", "BrokenPipe", "unexpected"))


def test_numpy_is_limited_to_one_thread_before_it_loads() -> None:
    code = (
        "import os, sys; from pdhocbf_drake.cli.main import main; assert 'numpy' not in sys.modules; "
        "main(['list']); assert os.environ['OPENBLAS_NUM_THREADS'] == '1'"
    )
    environment = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment)


def test_overrides_given_twice_are_refused_and_not_lost(elsewhere, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["run", "vhip", "--text", "friction: 0.4", "--text", "duration: 1.0"])
    assert "--text is given twice" in capsys.readouterr().err


def test_a_request_to_stop_after_the_last_tick_loses_nothing_recorded(elsewhere, monkeypatch, capsys):
    def be_asked_and_write(*arguments):
        os.kill(os.getpid(), signal.SIGINT)
        return write_metrics(*arguments)

    monkeypatch.setattr("pdhocbf_drake.analysis.report.write_metrics", be_asked_and_write)
    assert main(["run", "vhip", "--text", SHORT, "--out", "run"]) == 1
    assert "interrupted after the run" in capsys.readouterr().err
    assert read_run(Path("run")).log.ending == "finished"
    assert Path("run/metrics.json").exists()


@pytest.mark.parametrize("size", [["--kick", "nan"], ["--push", "inf"], ["--command", "0"]])
def test_events_without_a_size_are_refused_before_anything_runs(size, elsewhere, capsys):
    assert main(["worth", "vhip", *size]) == 1
    assert f"{size[0]} must be a finite number above 0 (given: {size[1]})" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "says"), [(["--gamma", "1.5", "0.5"], "(0, 1]"), (["--name", "a: b"], "--name must be letters")]
)
def test_a_bound_that_no_scenario_could_hold_is_not_designed(words, says, run_folder, elsewhere, capsys):
    assert main(["design-bound", str(run_folder), "--margin", "0.01", *words]) == 1
    assert says in capsys.readouterr().err
    assert not list(Path().iterdir())
