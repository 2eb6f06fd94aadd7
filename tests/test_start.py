"""Commands start without what they don't need: a list, a help or a refusal loads neither Drake nor numba."""

from __future__ import annotations

import importlib
import subprocess
import sys
from pathlib import Path

import pytest

from pdhocbf_drake import barriers, lazy, robot, walking
from pdhocbf_drake.simulation import drake_config
from pdhocbf_drake.simulation.scenario_file import load_scenario

HEAVY = {"pydrake", "numba", "scipy", "matplotlib", "jinja2", "tqdm", "dask", "pyarrow"}
_LISTED = (
    "import sys\nfrom pdhocbf_drake.cli import main\n"
    "try:\n    code = main(sys.argv[1:])\nexcept SystemExit as error:\n    code = error.code\n"
    "sys.stderr.flush()\nprint('\\n', code, *sys.modules)"
)
REFUSED = [
    ["run", "nosuch"],
    ["run", "walking", "--text", "x: 1"],
    ["run", "walking", "--text", "plant: {step: 1}"],
    ["run", "walking", "--text", "plant: {time_step: 0.007}"],
    ["run", "walking", "--text", "simulator: {start_time: 1.0}"],
    ["run", "walking", "--text", "robot: nosuch"],
    ["run", "walking", "--text", "mpc: {zmp_margin: 5.0}"],
    ["run", "walking", "--out", "/dev/null"],
    ["run", "van_der_pol", "--meshcat"],
    ["drive", "walking", "--headless"],
    ["drive", "nosuch"],
    ["drive", "walking", "--seconds", "0"],
    ["replay", "nosuch"],
    ["report", "nosuch"],
    ["compare", "nosuch", "nosuch"],
    ["export", "nosuch"],
    ["certify", "nosuch"],
    ["certify", "vhip", "--starts", "-1"],
    ["certify", "van_der_pol"],
    ["design-bound", "nosuch", "--margin", "0.1"],
    ["design-bound", "nosuch", "--margin", "0.1", "--gamma", "2"],
    ["bench", "--json", "/nosuch/bench.json"],
    ["gait", "vhip", "--vary", "stride=1"],
    ["worth", "walking", "--gamma", "2"],
    ["push", "vhip"],
    ["push", "walking", "--tolerance", "0"],
    ["push", "walking", "--barriers", "some"],
    ["reproduce", "--only", "fig99"],
    ["campaign", "nosuch"],
]


def started(*words: str, folder: Path, path: str = "") -> tuple[str, str, set[str]]:
    """Exit code, errors, and what has been loaded, by a command."""
    code = f"import sys; sys.path.insert(0, {path!r})\n{_LISTED}" if path else _LISTED
    done = subprocess.run([sys.executable, "-c", code, *words], cwd=folder, capture_output=True, text=True, check=True)
    number, *modules = done.stdout.splitlines()[-1].split()
    return number, done.stderr, {name.partition(".")[0] for name in modules}


@pytest.mark.parametrize("words", REFUSED, ids=" ".join)
def test_a_refusal_loads_nothing_that_it_does_not_need(words: list[str], tmp_path: Path) -> None:
    number, errors, loaded = started(*words, folder=tmp_path)
    assert (number, errors.count("\n"), errors[:9]) == ("1", 1, "pdhocbf: "), errors
    assert not loaded & HEAVY


@pytest.mark.parametrize("words", [["list"], ["--help"], ["--version"], ["run", "--help"], ["campaign", "--help"]])
def test_a_list_or_a_help_loads_nothing_that_it_does_not_need(words: list[str], tmp_path: Path) -> None:
    number, errors, loaded = started(*words, folder=tmp_path)
    assert (number, errors) == ("0", "")
    assert not loaded & HEAVY


def test_what_needs_drake_ends_in_one_sentence_where_it_cannot_be_loaded(tmp_path: Path) -> None:
    (tmp_path / "pydrake").mkdir()
    (tmp_path / "pydrake" / "__init__.py").write_text(
        "print('Drake failed to load a required library.')\n"
        "raise ImportError('libglib-2.0.so.0: cannot open shared object file: No file', path='pydrake/common.so')\n"
    )
    asks_drake = ["run", "walking", "--text", "plant: {contact_model: hydroelastic}"]
    for words in (["run", "walking"], ["run", "vhip"], ["push", "walking"], ["certify", "vhip"], asks_drake):
        number, errors, _ = started(*words, folder=tmp_path, path=str(tmp_path))
        assert number == "1"
        assert errors.splitlines()[-1].startswith("pdhocbf: Drake cannot load libglib-2.0.so.0; ")
        assert "failed to load" not in errors
    assert started("list", folder=tmp_path, path=str(tmp_path))[0] == "0"


@pytest.mark.parametrize("part", ["plant", "simulator"])
def test_the_defaults_that_are_written_down_are_those_of_drake(part: drake_config.Part) -> None:
    assert drake_config.defaults(part) == drake_config.asked_defaults(part)
    assert [*drake_config.defaults(part)] == [*drake_config.asked_defaults(part)]


def test_another_version_of_drake_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drake_config, "version", lambda name: "99.0")
    monkeypatch.setattr(drake_config, "asked_defaults", lambda part: {"new_key": 1.0})
    assert drake_config.defaults("simulator") == {"new_key": 1.0}


def test_drakes_own_refusals_are_kept() -> None:
    with pytest.raises(ValueError, match=r"plant: is refused by Drake: .*nosuch"):
        load_scenario("walking", "plant: {contact_model: nosuch}")
    assert load_scenario("walking", "plant: {time_step: 0.005}").plant["time_step"] == 0.005


@pytest.mark.parametrize("package", [barriers, robot, walking])
def test_lazy_names_are_all_there(package) -> None:
    assert set(package.__all__) <= set(dir(package))
    modules = {path.stem for path in Path(package.__file__).parent.glob("*.py")}
    for name in package.__all__:
        value = getattr(package, name)
        assert name not in modules or callable(value)
        assert name in vars(package)  # found without `__getattr__` from here on
    with pytest.raises(AttributeError, match="has no attribute 'nosuch'"):
        _ = package.nosuch


def test_a_lazy_name_loads_its_module_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "shelf").mkdir()
    (tmp_path / "shelf" / "__init__.py").write_text("")
    (tmp_path / "shelf" / "light.py").write_text("LIGHT = 1")
    (tmp_path / "shelf" / "heavy.py").write_text("HEAVY = 2")
    monkeypatch.syspath_prepend(tmp_path)
    shelf = importlib.import_module("shelf")
    load, names = lazy.lazy_names("shelf", {"light": ["LIGHT"], "heavy": ["HEAVY"]})
    assert load("LIGHT") == 1 and shelf.LIGHT == 1
    assert "shelf.light" in sys.modules and "shelf.heavy" not in sys.modules
    assert {"LIGHT", "HEAVY"} <= set(names())
