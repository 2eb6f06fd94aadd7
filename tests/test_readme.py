"""What README and pages say of the code is written by the code."""

import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

from pdhocbf_drake.errors import PdhocbfError
from pdhocbf_drake.mpc.terms import TERMS
from pdhocbf_drake.simulation.scenario_file import load_scenario, load_written, scenario_names

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
WITHOUT_NUMBERS = {"commands.md", "how_it_is_built.md", "index.md", "platforms.md", "python.md"}
HOUSE = (ROOT / "docs" / "how_it_is_built.md").read_text(encoding="utf-8")


def test_tables_are_those_of_the_code() -> None:
    tables = runpy.run_path(str(ROOT / "docs" / "tables.py"))
    texts = [page.read_text(encoding="utf-8") for page in tables["PAGES"]]
    assert [tables["with_tables"](text) for text in texts] == texts, "run python docs/tables.py"
    names = "rooms", "signals", "metrics", "face"
    assert all(any(tables[f"{name}_table"]() in text for text in texts) for name in names)


def test_badges_are_those_of_the_package() -> None:
    made = runpy.run_path(str(ROOT / "docs" / "badges.py"))["badges"]()
    assert all((ROOT / "docs" / name).read_text(encoding="utf-8") == text for name, text in made.items())
    assert all(f"(docs/{name})" in README for name in made)


def test_the_table_of_rooms_names_every_package() -> None:
    rooms = HOUSE.partition("<!-- rooms -->")[2].partition("<!-- end of rooms -->")[0]
    package = ROOT / "pdhocbf_drake"
    folders = {file.parent.relative_to(package).as_posix() for file in package.glob("*/**/__init__.py")}
    assert set(re.findall(r"^\| \d* ?\| `(\S+)/` \|", rooms, re.MULTILINE)) == folders


def test_the_table_of_rooms_follows_the_contract_from_the_lowest_layer_to_the_highest() -> None:
    layers = runpy.run_path(str(ROOT / "docs" / "tables.py"))["layers"]
    rows = re.findall(r"^\| (\d+) \| `(\w+)/` \|", HOUSE, re.MULTILINE)
    assert [(int(level), room) for level, room in rows] == [
        (level, room) for level, layer in enumerate(layers(), start=1) for room in layer
    ]


def test_the_page_of_scenario_keys_is_that_of_the_code() -> None:
    keys = runpy.run_path(str(ROOT / "docs" / "keys.py"))
    page = (ROOT / "docs" / "scenario.md").read_text(encoding="utf-8")
    assert keys["with_table"](page) == page, "run python docs/keys.py"
    assert keys["keys_table"]() in page


def test_the_page_s_example_is_a_scenario(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "scenario.md").read_text(encoding="utf-8")
    (tmp_path / "mine.yaml").write_text(re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)[0], encoding="utf-8")
    scenario = load_scenario(str(tmp_path / "mine.yaml"))
    assert (scenario.gait.stride, set(scenario.barriers)) == (0.1, {"forward_speed", "sideways"})


def test_the_example_of_one_s_own_robot_extends_the_imported_walk(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "own_robot.md").read_text(encoding="utf-8")
    (tmp_path / "mine.yaml").write_text(re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)[0], encoding="utf-8")
    (tmp_path / "mybot").mkdir()
    (tmp_path / "mybot" / "walking.yaml").write_text("extends: walking\ngait: {stride: 0.11}\n", encoding="utf-8")
    scenario = load_scenario(str(tmp_path / "mine.yaml"))
    assert (scenario.gait.stride, set(scenario.barriers)) == (0.11, {"forward_speed", "sideways"})
    assert len(scenario.commands) == 2 and len(scenario.pushes) == 1


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md", "models/README.md", "docs/*.md"])
def test_pictures_and_files_that_pages_link_exist(page: str) -> None:
    for path in ROOT.glob(page):
        links = re.findall(r"\]\((?!http|#)([^)#]+)", path.read_text(encoding="utf-8"))
        assert [link for link in links if not (path.parent / link).exists()] == [], path


def test_every_notebook_is_on_the_first_page() -> None:
    page = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    assert [
        path.name for path in sorted(ROOT.glob("notebooks/*.ipynb")) if f"../notebooks/{path.name})" not in page
    ] == []


def test_files_of_the_code_that_pages_name_exist() -> None:
    for path in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *ROOT.glob("docs/*.md")]:
        named = re.findall(r"`(\w+/[\w/]+\.(?:py|md))[`:]", path.read_text(encoding="utf-8"))
        missing = [file for file in named if not any((ROOT / top / file).exists() for top in ("", "pdhocbf_drake"))]
        assert missing == [], path


def test_the_container_has_the_packages_that_the_product_names() -> None:
    page = (ROOT / "docs" / "platforms.md").read_text(encoding="utf-8")
    (named,) = re.findall(r'packages = f"(.*?){suffix}"', (ROOT / "pdhocbf_drake/cli/loading.py").read_text("utf-8"))
    (installed,) = re.findall(r"apt-get install -y --no-install-recommends (.*)", page)
    assert f"{named}t64".split() == installed.split()[-3:]


def test_every_extra_is_on_the_page_of_platforms() -> None:
    tables = runpy.run_path(str(ROOT / "docs" / "tables.py"))
    project = tables["tomllib"].loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    page = (ROOT / "docs" / "platforms.md").read_text(encoding="utf-8")
    named = {name for names in re.findall(r"pip install '\.\[([\w,]+)\]'", page) for name in names.split(",")}
    assert named == set(project["project"]["optional-dependencies"])


def test_the_readme_is_short() -> None:
    assert len(README.splitlines()) < 150


def test_every_verb_is_on_the_page_of_commands() -> None:
    page = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    shown = re.findall(r"{program-output} pdhocbf (\S+) --help", page)
    usage = subprocess.run(
        [sys.executable, "-c", "from pdhocbf_drake.cli import main; main()", "--help"], capture_output=True, text=True
    )
    assert sorted(shown) == sorted(re.findall(r"^    (\S+)", usage.stdout.partition("VERB\n")[2], re.MULTILINE))


@pytest.mark.parametrize("page", ["README.md", "docs/barriers.md", "docs/certified_sets.md", "docs/mpc.md"])
def test_its_python_runs_and_prints_what_it_says(page: str, capsys: pytest.CaptureFixture[str]) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```(?:\n\n```text\n(.*?)```)?", text, re.DOTALL)
    assert blocks
    for number, (code, printed) in enumerate(blocks, start=1):
        exec(compile(code, f"{page}, Python block {number}", "exec"), {})
        assert capsys.readouterr().out == printed


def test_the_page_of_the_mpc_names_every_term_with_its_file_and_parameters() -> None:
    page = (ROOT / "docs" / "mpc.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \| `(\w+)\.py` \|", page, re.MULTILINE)
    assert rows == [(kind.__name__, kind.__module__.rpartition(".")[2]) for kind in TERMS]


@pytest.mark.parametrize("page", sorted({path.name for path in (ROOT / "docs").glob("*.md")} - WITHOUT_NUMBERS))
def test_every_page_ends_with_the_commands_that_make_its_numbers(page: str) -> None:
    *_, last = (ROOT / "docs" / page).read_text(encoding="utf-8").strip().split("\n\n")
    assert re.match(r"The numbers on this page: .*`(pdhocbf|python) .+`", last)


def test_every_packaged_scenario_is_named() -> None:
    commands = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    assert [name for name in scenario_names() if f"`{name}`" not in README or f"`{name}`" not in commands] == []


def _printed_commands() -> list[tuple[str, str, str]]:
    """(page, scenario, text) of each `--text '…'` in the repository's pages; without a packaged scenario, ""."""
    pages = [
        *ROOT.glob("*.md"),
        *ROOT.glob("docs/*.md"),
        ROOT / "models" / "README.md",
        *ROOT.glob("notebooks/*.ipynb"),
    ]
    found = []
    for page in pages:
        for before, text in re.findall(r"([^`\n]*)--text '([^'\n]*)'", page.read_text(encoding="utf-8")):
            verb_and_name = re.search(r"pdhocbf [\w-]+ (\w+) *(?:[^|;]*)$", before)
            name = verb_and_name[1] if verb_and_name and verb_and_name[1] in scenario_names() else ""
            found.append((page.name, name, text))
    return found


def test_every_printed_override_is_one() -> None:
    printed = [each for each in _printed_commands() if not re.search(r"…|^[A-Z]+$", each[2])]
    assert len(printed) > 40 and sum(bool(name) for _, name, _ in printed) > 25
    wrong = []
    for page, name, text in printed:
        try:
            load_written(name or "walking", text)
        except PdhocbfError as error:
            if "robot: " not in text:  # a robot that another command on the page makes is not here
                wrong.append(f"{page}: {text}: {error}")
    assert wrong == []
