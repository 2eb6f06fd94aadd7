"""Every notebook runs from top to bottom, is kept without outputs, and is short enough to read."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")

FOLDER = Path(__file__).resolve().parent.parent / "notebooks"
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
def test_a_notebook_runs(name, tmp_path, monkeypatch):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "1")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(FOLDER.parent), os.environ.get("PYTHONPATH", "")]))
    notebook = _read(name)
    # Deprecated names of ours, of Drake or of NumPy are errors here, as in Drake's tutorials.
    first = nbformat.v4.new_code_cell("import warnings; warnings.simplefilter('error', DeprecationWarning)")
    notebook.cells.insert(0, first)
    client = nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}})
    client.execute()
    assert not [o for cell in notebook.cells for o in cell.get("outputs", []) if o.output_type == "error"]


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
