"""What `import pdhocbf_drake` offers, how quickly, and that users' code is shown nothing else."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

import pdhocbf_drake

ROOT = Path(__file__).parents[1]
FACE = {
    "load_scenario", "Scenario", "simulate", "make_diagram", "Run", "read_run", "write_run", "replay", "report",
    "WalkController", "Robot", "certify", "push", "campaign", "InputError", "barriers", "estimation", "qp", "sets",
}  # fmt: skip
SUBPACKAGES = ("barriers", "estimation", "qp", "sets")
_BLOCK = re.compile(r"```python\n(.*?)```", re.DOTALL)


def notebook_code(path: Path) -> str:
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")


def shown_code() -> dict[str, str]:
    """The Python of notebooks, examples and README by its place."""
    shown = {path.name: notebook_code(path) for path in sorted((ROOT / "notebooks").glob("*.ipynb"))}
    shown |= {path.name: path.read_text(encoding="utf-8") for path in sorted((ROOT / "examples").glob("*.py"))}
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    return shown | {f"README {i}": code for i, code in enumerate(_BLOCK.findall(readme), start=1)}


def uses_of(code: str) -> set[str]:
    """The names and modules of this package that the code imports, from `pdhocbf_drake` on."""
    found = set()
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return {name for name in found if name.partition(".")[0] == "pdhocbf_drake"}


def offered(name: str) -> bool:
    """Whether a name is of the face, or of what one of its subpackages exports."""
    _, first, *rest = name.split(".") if "." in name else (name, "", "")
    if first in SUBPACKAGES and rest:
        return len(rest) == 1 and rest[0] in getattr(pdhocbf_drake, first).__all__
    return not first or (first in FACE and not rest)


def test_it_offers_these_names_and_no_more() -> None:
    assert set(pdhocbf_drake.__all__) == FACE
    public = {name for name in dir(pdhocbf_drake) if not name.startswith("_")}
    assert public == FACE


@pytest.mark.parametrize("name", sorted(FACE))
def test_every_name_is_there_and_documented(name: str) -> None:
    assert getattr(pdhocbf_drake, name).__doc__


def test_another_name_is_refused_with_those_that_exist() -> None:
    with pytest.raises(AttributeError, match="'walk'; it offers InputError, Robot, Run"):
        _ = pdhocbf_drake.walk


def test_importing_it_loads_nothing_heavy() -> None:
    code = "import sys, pdhocbf_drake; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.partition(".")[0] for name in done.stdout.split()}
    assert "pdhocbf_drake" in loaded
    assert not loaded & {"pydrake", "numpy", "numba", "scipy", "matplotlib", "pydantic", "yaml"}
    inside = {name for name in done.stdout.split() if name.startswith("pdhocbf_drake.")}
    assert not inside


@pytest.mark.parametrize(("place", "code"), shown_code().items(), ids=shown_code().keys())
def test_what_users_are_shown_imports_the_face_alone(place: str, code: str) -> None:
    assert [name for name in sorted(uses_of(code)) if not offered(name)] == []


def test_code_that_reaches_deeper_would_be_found() -> None:
    deep = "import pdhocbf_drake.mpc\nfrom pdhocbf_drake.qp.compiler import AffineMap\nfrom pdhocbf_drake import jit"
    assert len(uses_of(deep)) == 3
    assert not any(map(offered, uses_of(deep)))


def test_the_changelog_promises_every_name() -> None:
    promised = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").partition("\n## ")[0]
    assert {name for name in FACE if f"`{name}`" in promised} == FACE


def test_the_readme_names_every_example() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert all(f"(examples/{path.name})" in readme for path in (ROOT / "examples").glob("*.py"))
