"""Files and folders of results: nothing is lost, and nothing of others is touched."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
from pathlib import Path

import pytest
import synthetic

from pdhocbf_drake import report, write_run
from pdhocbf_drake.errors import InputError, RunFolderError
from pdhocbf_drake.files.file import replaced_file, write_text
from pdhocbf_drake.files.folder import new_folder
from pdhocbf_drake.files.places import check_file
from pdhocbf_drake.simulation.run_folder import new_run_folder, read_run

RUN = synthetic.run("vhip", duration=1.0)


def tree(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*")}


def save(place: Path) -> None:
    write_run(place, RUN.log, RUN.scenario)


def precious(folder: Path) -> Path:
    (folder / "sub").mkdir(parents=True)
    (folder / "thesis.tex").write_text("years of work")
    return folder


def test_a_file_is_written_through_links_which_stay(tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    for name, target in (("link", "deep/target"), ("second", "link"), ("dangling", "deep/new")):
        (tmp_path / name).symlink_to(target)
    for text, name in (("one", "link"), ("two", "second"), ("three", "dangling")):
        write_text(tmp_path / name, text)
        assert (tmp_path / name).is_symlink()
        assert (tmp_path / name).read_text() == text
    assert sorted(path.name for path in (tmp_path / "deep").iterdir()) == ["new", "target"]


def test_what_is_no_file_is_refused_and_stays(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "link").symlink_to("pipe")
    for name, says in (("pipe", "is a pipe"), ("link", "is a pipe"), ("folder", "is a folder"), ("loop", "symbolic")):
        for write in (lambda place: write_text(place, "x"), check_file):
            with pytest.raises((InputError, RunFolderError), match=says):
                write(tmp_path / name)
    with pytest.raises(InputError, match="is a device; the name of a file is needed"):
        check_file(Path("/dev/null"))
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)
    assert tree(tmp_path) == {"pipe", "folder", "loop", "link"}


def test_a_file_of_another_that_looks_temporary_is_not_touched(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    (tmp_path / ".report.html.part").symlink_to("thesis.tex")
    write_text(tmp_path / "report.html", "a page")
    assert (tmp_path / "thesis.tex").read_text() == "years of work"
    assert tree(tmp_path) == {"thesis.tex", ".report.html.part", "report.html"}


def test_a_replaced_file_keeps_its_mode(tmp_path: Path) -> None:
    path = tmp_path / "private.txt"
    path.write_text("old")
    path.chmod(0o600)
    write_text(path, "new")
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    before = os.umask(0o027)
    try:
        write_text(tmp_path / "other.txt", "new")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "other.txt").stat().st_mode) == 0o640


def test_a_file_is_checked_before_the_work_without_a_trace(tmp_path: Path) -> None:
    check_file(tmp_path / "new" / "deep" / "report.html")
    (tmp_path / "file").touch()
    with pytest.raises(RunFolderError, match="file is a file"):
        check_file(tmp_path / "file" / "report.html")
    assert tree(tmp_path) == {"file"}


@pytest.mark.parametrize("name", [".sx.part", ".sx.part.old", ".sx.old"])
def test_a_folder_of_another_that_looks_temporary_is_not_touched(name: str, tmp_path: Path) -> None:
    before = tree(precious(tmp_path / "precious"))
    (tmp_path / name).symlink_to("precious")
    for _ in range(2):
        save(tmp_path / "sx")
    (tmp_path / name).unlink()
    (tmp_path / "precious").rename(tmp_path / name)
    save(tmp_path / "sx")
    assert tree(tmp_path / name) == before
    assert len(read_run(tmp_path / "sx").log) == len(RUN.log)


def test_a_run_folder_is_written_through_a_link_twice(tmp_path: Path) -> None:
    (tmp_path / "target").mkdir()
    (tmp_path / "link").symlink_to("target")
    (tmp_path / "dangling").symlink_to("made")
    for _ in range(2):
        for name in ("link", "dangling"):
            save(tmp_path / name)
            assert (tmp_path / name).is_symlink()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["dangling", "link", "made", "target"]
    assert tree(tmp_path / "target") == tree(tmp_path / "made")


def test_a_folder_that_exists_stays_the_same_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "here").mkdir(mode=0o700)
    monkeypatch.chdir(tmp_path / "here")
    before = (tmp_path / "here").stat()
    for _ in range(2):
        save(Path())
    after = (tmp_path / "here").stat()
    assert (before.st_ino, before.st_mode) == (after.st_ino, after.st_mode)
    assert len(read_run(".").log) == len(RUN.log)


def test_a_place_that_is_no_folder_is_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(RunFolderError, match="it is a pipe"):
        save(tmp_path / "pipe")
    with pytest.raises(RunFolderError, match="/ cannot be written: it is not a run folder, since it holds "):
        save(Path("/"))
    assert tree(tmp_path) == {"pipe"}


@pytest.mark.parametrize(
    ("entry", "says"),
    [("figures/thesis.tex", "figures/thesis.tex"), ("report.html/thesis.tex", "report.html"),
     ("figures/a/b.png", "figures/a")],
)  # fmt: skip
def test_what_others_keep_inside_a_run_folder_is_not_deleted(entry: str, says: str, tmp_path: Path) -> None:
    place = tmp_path / "run"
    save(place)
    (place / entry).parent.mkdir(parents=True)
    (place / entry).write_text("years of work")
    with pytest.raises(RunFolderError, match=rf"it holds {says}$"):
        save(place)
    assert (place / entry).read_text() == "years of work"


def test_what_can_not_be_moved_to_its_place_is_kept_and_named(tmp_path: Path) -> None:
    place = tmp_path / "run"
    with (
        pytest.raises(RunFolderError, match="what was made is in ") as caught,
        new_run_folder(tmp_path / "run") as path,
    ):
        RUN.save(path)
        (tmp_path / "run").mkdir()
        (tmp_path / "run" / "thesis.tex").write_text("years of work")
    assert "it holds thesis.tex" in str(caught.value)
    assert len(read_run(str(caught.value).rpartition(" is in ")[2]).log) == len(RUN.log)
    assert tree(place) == {"thesis.tex"}


def test_files_of_a_killed_run_are_cleared_by_the_next(tmp_path: Path) -> None:
    code = (
        "import os, signal; from pathlib import Path; from pdhocbf_drake.files.folder import new_folder\n"
        "with new_folder(Path('run'), {'a'}) as new:\n"
        "    (new.path / 'a').touch(); os.kill(os.getpid(), signal.SIGKILL)"
    )
    for _ in range(2):  # beside a new place, and inside one that exists
        killed = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=False)
        assert killed.returncode == -signal.SIGKILL
        assert len([path for path in tmp_path.rglob("*.part")]) == 1
        with new_folder(tmp_path / "run", {"a"}) as new:
            assert [path for path in tmp_path.rglob("*.part")] == [new.path]
        assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_pages_written_later_keep_the_place(tmp_path: Path) -> None:
    for _ in range(2):
        with new_folder(tmp_path / "run", {"a"}) as new:
            (new.path / "a").touch()
            new.finish()
            with (
                pytest.raises(RunFolderError, match="another run is being written"),
                new_folder(tmp_path / "run", {"a"}),
            ):
                pytest.fail("the second run must not start")
        assert tree(tmp_path) == {"run", "run/a"}


def test_a_report_into_a_pipe_is_refused_before_the_work(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="pipe is a pipe; the name of a file is needed"):
        report(RUN, tmp_path / "pipe")


def test_an_error_while_writing_leaves_the_older_file_and_no_other(tmp_path: Path) -> None:
    write_text(tmp_path / "page", "old")
    with pytest.raises(RuntimeError), replaced_file(tmp_path / "page") as staging:
        staging.write_text("half")
        raise RuntimeError
    assert (tmp_path / "page").read_text() == "old"
    assert tree(tmp_path) == {"page"}
