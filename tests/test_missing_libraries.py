"""On a machine without the libraries that Drake loads, every verb ends with one sentence that names the packages."""

from __future__ import annotations

import importlib
import platform
import re
from pathlib import Path

import pytest

from pdhocbf_drake.cli import main
from pdhocbf_drake.cli.loading import load

GLIB = "libglib-2.0.so.0: cannot open shared object file: No such file or directory"


@pytest.fixture
def bare(monkeypatch: pytest.MonkeyPatch) -> None:
    """Importing anything prints what Drake prints, and fails as Drake fails without GLib."""

    def fails(name: str) -> None:
        print("Drake failed to load a required library.")
        raise ImportError(GLIB, path="/site-packages/pydrake/common/_module_py.so")

    monkeypatch.setattr(importlib, "import_module", fails)


@pytest.mark.parametrize(
    ("release", "cure"),
    [
        (
            {"ID": "debian", "VERSION_ID": "12", "PRETTY_NAME": "Debian GNU/Linux 12 (bookworm)"},
            "on Debian GNU/Linux 12 (bookworm), install its packages: apt-get install libx11-6 libsm6 libglib2.0-0",
        ),
        (
            {"ID": "debian", "VERSION_ID": "13", "PRETTY_NAME": "Debian GNU/Linux 13 (trixie)"},
            "on Debian GNU/Linux 13 (trixie), install its packages: apt-get install libx11-6 libsm6 libglib2.0-0t64",
        ),
        (
            {"ID": "debian", "PRETTY_NAME": "Debian GNU/Linux forky/sid"},
            "on Debian GNU/Linux forky/sid, install its packages: apt-get install libx11-6 libsm6 libglib2.0-0t64",
        ),
        (
            {"ID": "ubuntu", "ID_LIKE": "debian", "VERSION_ID": "22.04", "PRETTY_NAME": "Ubuntu 22.04.5 LTS"},
            "on Ubuntu 22.04.5 LTS, install its packages: apt-get install libx11-6 libsm6 libglib2.0-0",
        ),
        (
            {"ID": "ubuntu", "ID_LIKE": "debian", "VERSION_ID": "24.04", "PRETTY_NAME": "Ubuntu 24.04.1 LTS"},
            "on Ubuntu 24.04.1 LTS, install its packages: apt-get install libx11-6 libsm6 libglib2.0-0t64",
        ),
        (
            {"ID": "linuxmint", "ID_LIKE": "ubuntu debian", "VERSION_ID": "22", "PRETTY_NAME": "Linux Mint 22"},
            "on Linux Mint 22, install its packages: apt-get install libx11-6 libsm6 libglib2.0-0",
        ),
        (
            {"ID": "fedora", "VERSION_ID": "43", "PRETTY_NAME": "Fedora Linux 43"},
            "install the libraries libX11, libSM and GLib 2 (libX11.so.6, libSM.so.6, libglib-2.0.so.0)",
        ),
    ],
    ids=lambda case: case.get("PRETTY_NAME") if isinstance(case, dict) else "",
)
def test_the_packages_are_those_of_the_distribution(release, cure, bare, monkeypatch, capsys) -> None:
    monkeypatch.setattr(platform, "freedesktop_os_release", lambda: release)
    assert main(["run", "walking"]) == 1
    assert capsys.readouterr() == ("", f"pdhocbf: Drake cannot load libglib-2.0.so.0; {cure}\n")


@pytest.mark.parametrize("verb", ["list", "run", "report", "bench", "campaign"])
def test_every_verb_ends_so(verb, bare, capsys) -> None:
    assert main([verb]) == 1
    printed = capsys.readouterr()
    assert printed.out == "" and printed.err.startswith("pdhocbf: Drake cannot load libglib-2.0.so.0; ")


def test_the_page_on_platforms_has_a_container_with_those_packages(bare, monkeypatch, capsys) -> None:
    page = (Path(__file__).parents[1] / "docs" / "platforms.md").read_text(encoding="utf-8")
    (lines,) = (block.strip().splitlines() for block in re.findall(r"```dockerfile\n(.*?)```", page, re.DOTALL))
    assert len(lines) == 5
    assert (lines[0], lines[-1]) == ("FROM debian:13-slim", "RUN make walk")  # `.ci/debian13` makes them without Docker
    monkeypatch.setattr(platform, "freedesktop_os_release", lambda: {"ID": "debian", "VERSION_ID": "13"})
    main(["run", "walking"])
    named = capsys.readouterr().err.split("apt-get install ")[1].split()
    assert lines[1].split("--no-install-recommends ")[1].split() == ["python3-venv", "make", *named]


def test_without_a_description_of_the_system_the_libraries_are_named(bare, monkeypatch, capsys) -> None:
    def absent() -> dict[str, str]:
        raise OSError

    monkeypatch.setattr(platform, "freedesktop_os_release", absent)
    assert main(["list"]) == 1
    assert "install the libraries libX11, libSM and GLib 2" in capsys.readouterr().err


def test_another_failing_import_is_not_blamed_on_the_system(tmp_path, monkeypatch, capsys) -> None:
    (tmp_path / "half_there.py").write_text("print('as far as here')\nimport not_there_at_all\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ModuleNotFoundError, match="not_there_at_all"):
        load("half_there")


def test_what_a_module_prints_is_printed(tmp_path, monkeypatch, capsys) -> None:
    (tmp_path / "talks.py").write_text("print('hello')\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert load("talks").__name__ == "talks"
    assert capsys.readouterr().out == "hello\n"
