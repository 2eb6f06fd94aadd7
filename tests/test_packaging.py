"""What is installed is what the checkout holds: scenarios, page template, robots, and the promised versions."""

from __future__ import annotations

import importlib.metadata
import sys
import zipfile
from pathlib import Path

import pytest

import pdhocbf_drake

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def pyproject() -> dict:
    if sys.version_info < (3, 11):
        pytest.skip("tomllib came with Python 3.11")
    import tomllib

    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def test_a_wheel_holds_code_scenarios_template_and_robots(tmp_path, monkeypatch):
    builder = pytest.importorskip("hatchling.builders.wheel")
    monkeypatch.chdir(ROOT)
    (built,) = builder.WheelBuilder(str(ROOT)).build(directory=str(tmp_path), versions=["standard"])
    names = set(zipfile.ZipFile(built).namelist())
    wanted = {
        path.relative_to(ROOT).as_posix()
        for pattern in ("**/*.py", "scenarios/*.yaml", "campaigns/*.yaml", "*/*.j2", "py.typed")
        for path in (ROOT / "pdhocbf_drake").glob(pattern)
    }
    for ending in ("urdf", "yaml", "gltf"):
        files = (ROOT / "models").rglob(f"*.{ending}")
        wanted |= {f"pdhocbf_drake/{path.relative_to(ROOT).as_posix()}" for path in files}
    assert "pdhocbf_drake/models/package.xml" in names
    assert wanted <= names, sorted(wanted - names)[:5]
    assert not any(name.startswith(("tests/", "runs/")) for name in names)


def test_the_physics_and_the_solver_are_the_promised_versions(pyproject):
    for requirement in pyproject["project"]["dependencies"]:
        name, equal, version = requirement.partition("==")
        if equal:
            assert importlib.metadata.version(name) == version


def test_constraints_meet_what_the_package_asks_for(pyproject):
    from packaging.requirements import Requirement

    pinned = {}
    for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines():
        if line and not line.startswith("#"):
            pin = Requirement(line)
            if pin.marker is None or pin.marker.evaluate():
                pinned[pin.name.lower()] = next(iter(pin.specifier)).version
    extras = pyproject["project"]["optional-dependencies"]
    for text in [*pyproject["project"]["dependencies"], *(text for extra in extras.values() for text in extra)]:
        requirement = Requirement(text)
        assert requirement.specifier.contains(pinned[requirement.name.lower()]), text


def test_changelog_and_citation_are_of_this_version():
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    first = next(line.split()[1] for line in text.splitlines() if line.startswith("## "))
    assert first in ("Unreleased", pdhocbf_drake.__version__)
    assert f"version: {pdhocbf_drake.__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
