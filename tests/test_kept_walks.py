"""Compiled programs on disk: the same walk to the last bit, and whatever is wrong with them, compiled."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from logs import differences

from pdhocbf_drake import simulate
from pdhocbf_drake.cli import main
from pdhocbf_drake.files.arrays import read_arrays, write_arrays
from pdhocbf_drake.files.cache import cache_files, cache_folder, throw_out
from pdhocbf_drake.mpc.axis_problem import AxisProblem
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.digest import digest
from pdhocbf_drake.mpc.terms.effort import Effort
from pdhocbf_drake.simulation import kept_walk
from pdhocbf_drake.simulation.build import build_walk, complete_programs
from pdhocbf_drake.simulation.kept_walk import is_kept, keep_programs, kept_programs, walk_file
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario

GAIT = "duration: 3.0, gait: {ticks_per_step: 10, double_support_ticks: 2, tick: 0.04, com_height_phase: 0}"
COARSE = f"{GAIT}, mpc: {{horizon: 20, freeze_ticks: 2, recovery: {{calm_ticks: 10}}}}"
PUSHED = f"{{{COARSE}, pushes: [{{step: 3, force: [0, 6, 0]}}]}}"
HARD = f"{{{GAIT}, mpc: {{horizon: 20, freeze_ticks: 2, barrier: hard, zmp_velocity_max: [2.5, 2.5]}}}}"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache."""
    monkeypatch.setenv("PDHOCBF_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The phases of the programs that are compiled."""
    phases: list[int] = []
    compile_phase: Callable = AxisProblem.compile
    monkeypatch.setattr(
        AxisProblem, "compile", lambda self, phase: (phases.append(phase), compile_phase(self, phase))[1]
    )
    return phases


def scenario(text: str = f"{{{COARSE}}}") -> Scenario:
    return load_scenario("vhip", text)


def test_arrays_are_read_as_they_were_written(tmp_path: Path) -> None:
    arrays = {
        "real": np.array([[0.1, -0.0], [np.nan, np.inf]]), "sparse": np.eye(40)[:, ::3], "empty": np.zeros((0, 3)),
        "integers": np.arange(7, dtype=np.int32), "long": np.array([2**60, 0]), "again": np.eye(40)[:, ::3],
        "signs": np.where(np.arange(300) % 100 == 5, -0.0, 0.0),
    }  # fmt: skip
    write_arrays(tmp_path / "some.walk", arrays, "a few words")
    read = read_arrays(tmp_path / "some.walk")
    assert read is not None
    assert (read.about, list(read)) == ("a few words", list(arrays))
    for name, array in arrays.items():
        assert (read[name].dtype, read[name].shape) == (array.dtype, array.shape)
        assert read[name].tobytes() == array.tobytes()
        assert read[name].flags.aligned
    assert (tmp_path / "some.walk").stat().st_size < 4000  # without zeros, and each array once


@pytest.mark.parametrize("place", ["start", "numbers", "index", "data", "end"])
def test_a_file_that_is_not_as_it_was_written_is_none(place: str, tmp_path: Path) -> None:
    path = tmp_path / "some.walk"
    write_arrays(path, {"a": np.arange(100.0)})
    whole = path.read_bytes()
    at = {"start": 0, "numbers": 20, "index": 60, "data": len(whole) - 300, "end": len(whole) - 1}[place]
    path.write_bytes(whole[:at] + bytes([whole[at] ^ 4]) + whole[at + 1 :])
    assert read_arrays(path) is None
    for torn in (whole[:at], whole + b"\0", b""):
        path.write_bytes(torn)
        assert read_arrays(path) is None
    assert read_arrays(tmp_path) is None and read_arrays(tmp_path / "nothing") is None


@pytest.mark.parametrize("text", [PUSHED, HARD])
def test_a_walk_with_kept_programs_is_the_same_to_the_last_bit(
    text: str, folder: Path, compiled: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    one = scenario(text)
    first = simulate(one)
    complete_programs(one)
    assert is_kept(one)
    compiled.clear()
    build_walk(one)
    assert compiled == []
    assert differences(simulate(one), first) == []
    monkeypatch.setenv("PDHOCBF_CACHE", "off")
    assert differences(simulate(one), first) == []


def test_the_programs_of_a_disturbed_walk_are_kept_too(folder: Path, compiled: list[int]) -> None:
    complete_programs(scenario())
    compiled.clear()
    walk = build_walk(scenario())
    walk.mpc.prepare()
    assert walk.mpc.recovery is not None and compiled == []
    before = folder.stat().st_mtime_ns
    complete_programs(scenario())
    assert folder.stat().st_mtime_ns == before  # nothing is written twice


def test_what_does_not_change_a_program_shares_its_file_and_what_does_has_another(folder: Path) -> None:
    file = walk_file(scenario())
    bound = "barriers: {forward_speed: {bound: {kind: constant, value: 1.0, margin: null}}}"
    for text in (PUSHED, f"{{{COARSE}, {bound}}}", f"{{{COARSE}, seed: 3, name: other}}"):
        assert walk_file(scenario(text)) == file
    others = [
        f"{{{COARSE}, barriers: {{forward_speed: {{gamma: [0.5, 0.4]}}}}}}",
        f"{{{COARSE}, barriers: {{forward_speed: null}}}}",
        "{gait: {stride: 0.1}}",
        "{mpc: {slack_weight: [1.0, 2.0]}}",
        "{mpc: {recovery: null}}",
    ]
    assert len({file, *(walk_file(scenario(text)) for text in others)}) == 6


@pytest.mark.parametrize("part", ["sys.version", "source", "drake", "daqp", "numpy", "pdhocbf_drake"])
def test_another_version_has_files_of_its_own(part: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def named(monkeypatch: pytest.MonkeyPatch) -> Path | None:
        kept_walk.made_by.cache_clear()
        return walk_file(scenario())

    before = named(monkeypatch)
    with monkeypatch.context() as patch:
        if part == "sys.version":
            patch.setattr("sys.version", "4.0")
        elif part == "pdhocbf_drake":
            patch.setattr("pdhocbf_drake.__version__", "99")
        elif part == "source":
            patch.setattr(Path, "read_bytes", lambda self: b"another line")
        else:
            patch.setattr(kept_walk, "version", lambda name: "99" if name == part else "1")
        assert named(patch) != before
    assert named(monkeypatch) == before


def spoil_nothing(path: Path) -> None:
    """The file is good."""


def spoil_torn(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-1000])


def spoil_foreign(path: Path) -> None:
    path.write_text("a letter to my grandmother")


def spoil_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def spoil_other(path: Path) -> None:
    """That of another walk, whose orbit has the same name."""
    other = scenario("{gait: {com_height: 0.5}}")
    build_walk(other)
    shutil.copy(walk_file(other) or "", path)


def spoil_place(path: Path) -> None:
    shutil.rmtree(path.parent)
    path.parent.write_text("a file in place of the folder")


@pytest.mark.parametrize(
    "spoil",
    [spoil_nothing, spoil_torn, spoil_foreign, spoil_folder, spoil_other, spoil_place],
    ids=lambda f: f.__name__,
)
def test_whatever_is_wrong_programs_are_compiled(spoil: Callable, folder: Path, compiled: list[int]) -> None:
    one = scenario()
    first = simulate(one)
    path = walk_file(one)
    assert path is not None and path.exists()
    spoil(path)
    compiled.clear()
    build_walk(one)
    assert (len(compiled) <= 2) == (spoil is spoil_nothing)  # the first program of a disturbed walk says its rows
    assert differences(simulate(one), first) == []


def test_a_full_disk_or_two_writers_cost_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one = scenario()
    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", lambda *_, **__: (_ for _ in ()).throw(OSError(28, "No space left on device")))
        build_walk(one)
    assert cache_files(folder) == [] and [*folder.iterdir()] == []
    first, second = kept_programs(one), kept_programs(one)
    for programs in (first, second):
        programs.array("orbit", lambda: np.ones(3))
        keep_programs(one, programs)
    assert kept_programs(one).kept["orbit"].tolist() == [1.0, 1.0, 1.0]


def test_the_file_that_was_used_longest_ago_goes_first(tmp_path: Path) -> None:
    for age, name in enumerate(["c.walk", "b.walk", "a.walk", "mine.txt", ".a.walk.0123456789abcdef.part"]):
        (tmp_path / name).write_bytes(bytes(100))
        os.utime(tmp_path / name, (1e9 - age, 1e9 - age))
    assert throw_out(tmp_path, limit=250) == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == ["b.walk", "c.walk", "mine.txt"]
    assert throw_out(tmp_path / "nowhere") == 0


def test_the_folder_is_that_of_the_platform_or_the_variable(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("PDHOCBF_CACHE", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    assert cache_folder() == tmp_path / ".cache" / "pdhocbf_drake"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")  # to be ignored
    assert cache_folder() == tmp_path / ".cache" / "pdhocbf_drake"
    monkeypatch.setenv("XDG_CACHE_HOME", "/var/x")
    assert cache_folder() == Path("/var/x/pdhocbf_drake")
    monkeypatch.setattr("sys.platform", "darwin")
    assert cache_folder() == tmp_path / "Library" / "Caches" / "pdhocbf_drake"
    monkeypatch.setenv("PDHOCBF_CACHE", "off")
    assert cache_folder() is None
    monkeypatch.setenv("PDHOCBF_CACHE", "/elsewhere")
    assert cache_folder() == Path("/elsewhere")


def test_pdhocbf_cache_shows_and_clears_it(folder: Path, capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    assert main(["cache"]) == 0
    assert capsys.readouterr().out == f"{folder}: 0 walks, 0.0 MB of at most 256.0 MB\n"
    build_walk(scenario())
    (folder / "mine.txt").write_text("kept")
    (folder / f"{'0' * 32}.walk").write_text("torn")
    assert main(["cache"]) == 0
    shown = capsys.readouterr().out
    assert "2 walks" in shown and "\nvhip " in shown and "\ndamaged " in shown
    assert main(["cache", "--clear"]) == 0
    assert capsys.readouterr().out == f"deleted 2 of 2 files in {folder}\n"
    assert [path.name for path in folder.iterdir()] == ["mine.txt"]
    monkeypatch.setenv("PDHOCBF_CACHE", "off")
    assert main(["cache"]) == 0
    assert capsys.readouterr().out.startswith("there is no cache")


def test_a_run_says_where_its_programs_are_if_it_is_asked(folder: Path, tmp_path: Path, capsys) -> None:
    text = json.dumps({"duration": 0.5})
    words = ["run", "vhip", "--text", text, "--no-replay", "--out", str(tmp_path / "run")]
    file = walk_file(load_scenario("vhip", text))
    for verbose, says in ((["--verbose"], "compiled, for"), (["--verbose"], "read from"), ([], "")):
        assert main([*words, *verbose]) == 0
        printed = capsys.readouterr().err
        assert (f"pdhocbf: programs are {says} {file}\n" in printed) == bool(says)
        assert ("programs" in printed) == bool(says)


def test_a_name_is_given_to_plain_values_alone() -> None:
    assert digest((1, "a", b"b", None, (Effort, 0.5))) == digest((1, "a", b"b", None, (Effort, 0.5)))
    assert len({digest(key) for key in (1, 1.0, True, "1", b"1", (1,), Effort)}) == 7
    assert digest((1, object())) is None


def test_every_problem_of_the_packaged_walks_has_a_name() -> None:
    walk = build_walk(load_scenario("walking"))
    problems = [*walk.mpc.problems, *(walk.mpc.recovery or walk.mpc).problems]
    assert isinstance(walk.mpc, PeriodicMpc)
    assert None not in [digest(problem.key) for problem in problems]
