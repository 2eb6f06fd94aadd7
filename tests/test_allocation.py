"""The roomy cache of freed memory: which processes have it, and that nothing else of them changes."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

import pdhocbf_drake.__main__ as command
from pdhocbf_drake.allocation import begin_again_roomy, roomy
from pdhocbf_drake.studies.shared.pool import of_a_worker

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
    plain = {name: value for name, value in os.environ.items() if name != "GLIBC_TUNABLES"}
    words = [sys.executable, "-O", "-c", code, "run", "two words"]
    done = subprocess.run(words, env=plain, capture_output=True, text=True, check=True)
    first, again, said = done.stdout.splitlines()
    assert first == again
    assert said == f"{TUNABLE}=512 ['run', 'two words'] 1"


@linux
def test_a_process_that_cannot_begin_again_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("GLIBC_TUNABLES", raising=False)
    tried = []

    def refused(*arguments: object) -> None:
        tried.append(arguments)
        raise PermissionError

    monkeypatch.setattr(os, "execve", refused)
    begin_again_roomy()
    assert [arguments[:2] for arguments in tried] == [(sys.executable, sys.orig_argv)]


@pytest.mark.parametrize(("words", "begins_again"), [(["run", "x"], True), (["list"], False), ([], False)])
def test_verbs_that_simulate_begin_again(
    words: list[str], begins_again: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    begun: list[bool] = []
    monkeypatch.setattr(command, "begin_again_roomy", lambda: begun.append(True))
    monkeypatch.setattr("pdhocbf_drake.cli.main", lambda: 5)
    monkeypatch.setattr(sys, "argv", ["pdhocbf", *words])
    assert command.start() == 5
    assert bool(begun) == begins_again


@linux
def test_workers_have_it_and_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GLIBC_TUNABLES", "glibc.malloc.check=0")
    environment = of_a_worker()
    assert environment["GLIBC_TUNABLES"] == f"glibc.malloc.check=0:{TUNABLE}=512"
    assert environment["OPENBLAS_NUM_THREADS"] == "1"
    assert os.environ["GLIBC_TUNABLES"] == "glibc.malloc.check=0"
