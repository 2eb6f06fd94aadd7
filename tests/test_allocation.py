"""The roomy cache of freed memory: which processes have it, and that nothing else of them changes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import pdhocbf_drake.__main__ as command
from pdhocbf_drake.allocation import begin_again_roomy, roomy

TUNABLE = "glibc.malloc.tcache_count"
linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="glibc is that of Linux")


@linux
def test_what_the_user_has_set_stays() -> None:
    assert roomy({}) == {"GLIBC_TUNABLES": f"{TUNABLE}=512"}
    assert roomy({"GLIBC_TUNABLES": "glibc.malloc.check=0"}) == {
        "GLIBC_TUNABLES": f"glibc.malloc.check=0:{TUNABLE}=512"
    }
    assert roomy({"GLIBC_TUNABLES": f"{TUNABLE}=7"}) == {}


def test_other_systems_have_no_such_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "darwin")
    assert roomy({}) == {}


@linux
def test_a_process_begins_again_once_as_the_same_one_with_the_same_words() -> None:
    code = (
        "import os, sys; from pdhocbf_drake.allocation import begin_again_roomy; print(os.getpid(), flush=True)\n"
        "begin_again_roomy(); print(os.environ['GLIBC_TUNABLES'], sys.argv[1:], sys.flags.optimize)"
    )
    words = [sys.executable, "-O", "-c", code, "run", "two words"]
    done = subprocess.run(words, env=plain(), capture_output=True, text=True, check=True)
    first, again, said = done.stdout.splitlines()
    assert first == again
    assert said == f"{TUNABLE}=512 ['run', 'two words'] 1"


def plain() -> dict[str, str]:
    """The environment of a process that has not begun again, and that no measurement of coverage traces."""
    others = {name: value for name, value in os.environ.items() if not name.startswith("COV")}
    return {name: value for name, value in others.items() if name not in ("GLIBC_TUNABLES", "PDHOCBF_BEGUN")}


@linux
@pytest.mark.parametrize(
    "command", [[sys.executable, "-m", "pdhocbf_drake"], [str(Path(sys.executable).parent / "pdhocbf")]]
)
def test_the_command_begins_again_and_says_what_it_says(command: list[str]) -> None:
    if not Path(command[0]).exists():
        pytest.skip("the package's commands are not installed beside Python")
    done = subprocess.run([*command, "run", "nosuch"], env=plain(), capture_output=True, text=True)
    assert done.returncode == 1
    assert done.stderr.count("unknown scenario 'nosuch'") == 1


@linux
@pytest.mark.parametrize("added", [{"PDHOCBF_BEGUN": "1"}, {"GLIBC_TUNABLES": f"{TUNABLE}=7"}])
def test_no_process_begins_again_twice(added: dict[str, str]) -> None:
    assert begun_by(["-c", BEGINS, "run"], added) == 1


@linux
def test_another_program_does_not_begin_again(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(BEGINS, encoding="utf-8")
    assert begun_by([str(script), "run", "two words"], {}) == 2
    assert begun_by(["-c", f"import sys; sys.argv = ['x', 'run']; {BEGINS}"], {}) == 1  # other arguments
    assert begun_by(["-c", f"import sys; sys.settrace(lambda *_: None); {BEGINS}", "run"], {}) == 1  # a debugger
    assert begun_by(["-", "run"], {}, BEGINS) == 1  # from a pipe, which is empty the second time
    assert begun_by([], {}, BEGINS) == 1


BEGINS = "import sys; print('begun', flush=True); from pdhocbf_drake.allocation import begin_again_roomy as b; b()"


def begun_by(words: list[str], added: dict[str, str], given: str = "") -> int:
    """How many times a Python with these words runs its program."""
    python = [sys.executable, *words]
    done = subprocess.run(python, env=plain() | added, input=given, capture_output=True, text=True, check=True)
    return done.stdout.count("begun")


@linux
def test_a_process_that_cannot_begin_again_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("GLIBC_TUNABLES", "PDHOCBF_BEGUN"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "gettrace", lambda: None)  # that of a measurement of coverage
    monkeypatch.setattr(sys, "argv", ["x", *sys.orig_argv[1:]])
    tried = []

    def refused(*arguments: object) -> None:
        tried.append(arguments)
        raise PermissionError

    monkeypatch.setattr(os, "execve", refused)
    begin_again_roomy()
    assert [arguments[:2] for arguments in tried] == [(sys.executable, sys.orig_argv)]


@pytest.mark.parametrize(
    ("words", "begins_again"),
    [(["run", "x"], True), (["drive"], True), (["push", "x"], False), (["list"], False), ([], False)],
)
def test_verbs_that_simulate_once_begin_again(
    words: list[str], begins_again: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    begun: list[bool] = []
    monkeypatch.setattr(command, "begin_again_roomy", lambda: begun.append(True))
    monkeypatch.setattr("pdhocbf_drake.cli.main", lambda: 5)
    monkeypatch.setattr(sys, "argv", ["pdhocbf", *words])
    assert command.start() == 5
    assert bool(begun) == begins_again
