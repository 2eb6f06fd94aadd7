"""Every notebook runs from top to bottom, is kept without outputs, and is short enough to read."""

from __future__ import annotations

import os
import platform
import re
import subprocess
import sys
from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "notebooks"
NAMES = [
    "01_periodic_barriers",
    "02_periodic_mpc_on_the_vhip",
    "03_walking_biped",
    "04_conservatism_and_unsafe_events",
    "05_your_own_periodic_system",
    "06_an_obstacle_that_moves",
    "07_a_walk_that_turns",
    "08_g1_walks_in_drake",
    "09_up_a_staircase",
]


def _read(name: str):
    return nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)


def test_the_promised_notebooks_exist():
    assert sorted(path.stem for path in FOLDER.glob("*.ipynb")) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_runs_without_error_or_warning(name, tmp_path, monkeypatch):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "1")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    monkeypatch.setenv("PYTHONWARNINGS", "error::DeprecationWarning")  # as in docs/conf.py
    notebook = _built(name) or _run(name, tmp_path)
    assert _is_run(notebook)
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert [o for o in outputs if o.output_type == "error" or o.get("name") == "stderr"] == []
    assert [o for o in outputs if o.output_type == "execute_result"] == []  # what is not printed ends with ";"


def _run(name: str, folder: Path):
    client = nbclient.NotebookClient(_read(name), timeout=300, resources={"metadata": {"path": str(folder)}})
    return client.execute()


def _built(name: str):
    """The notebook as `make docs` has run it, with this Python and after every change of a file; else None."""
    built = ROOT / "build" / "jupyter_execute" / "notebooks" / f"{name}.ipynb"
    if not built.exists() or built.stat().st_mtime < max(path.stat().st_mtime for path in _sources(name)):
        return None
    notebook = nbformat.read(built, as_version=4)
    same = [cell.source for cell in notebook.cells] == [cell.source for cell in _read(name).cells]
    same = same and notebook.metadata.get("language_info", {}).get("version") == platform.python_version()
    return notebook if same and _is_run(notebook) else None


def _sources(name: str) -> list[Path]:
    """What a notebook's outputs hang on."""
    code = [path for top in ("pdhocbf_drake", "models") for path in (ROOT / top).rglob("*") if path.is_file()]
    others = [
        FOLDER / f"{name}.ipynb",
        *(ROOT / file for file in ("docs/conf.py", "pyproject.toml", "constraints.txt")),
    ]
    return [path for path in [*code, *others] if "__pycache__" not in path.parts]  # numba's files are there too


def _is_run(notebook) -> bool:
    """Whether every cell has been run, one after the other."""
    counts = [cell.execution_count for cell in notebook.cells if cell.cell_type == "code"]
    return counts == list(range(1, len(counts) + 1))


@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_is_thin_and_cleared(name):
    notebook = _read(name)
    for cell in notebook.cells:
        assert len(cell.source.splitlines()) < 40
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None
    assert notebook.cells[0].cell_type == "markdown"
    assert notebook.cells[0].source.startswith("# ")
    text = "\n".join(cell.source for cell in notebook.cells if cell.cell_type == "code")
    text = text.replace("._replace(", "")  # a public method of named tuples
    assert not any(f"._{letter}" in text for letter in "abcdefghijklmnopqrstuvwxyz"), "only the public API"


def test_a_reader_uses_the_library_from_scratch_in_under_60_lines():
    cells = _read("05_your_own_periodic_system").cells
    code = [line for cell in cells if cell.cell_type == "code" for line in cell.source.splitlines() if line.strip()]
    plotting = [line for line in code if any(word in line for word in ("axes", "plt", "figure"))]
    assert len(code) - len(plotting) < 60


def test_formulas_are_drawn_on_the_site_without_a_network(tmp_path):
    pytest.importorskip("myst_nb")
    options = ["-D", "nb_execution_mode=off", "-D", "root_doc=notebooks/06_an_obstacle_that_moves"]
    options += ["-D", "include_patterns=notebooks/06*.ipynb", "-D", "extensions=myst_nb,sphinx.ext.autodoc"]
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "-c", str(ROOT / "docs"), *options, str(ROOT), str(tmp_path)]
    subprocess.run(command, check=True)
    page = (tmp_path / "notebooks" / "06_an_obstacle_that_moves.html").read_text(encoding="utf-8")
    formulas = [m for cell in _read("06_an_obstacle_that_moves").cells for m in re.findall(r"\$[^$]+\$", cell.source)]
    assert page.count("<math") == len(formulas) > 5
    assert [formula for formula in formulas if formula in page] == []
    assert re.findall(r'<(?:script|link)[^>]*="https?://[^"]*', page) == []
