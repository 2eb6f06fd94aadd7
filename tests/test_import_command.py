"""`pdhocbf import`: what it writes, where it does not write, and its messages."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import bipeds
import pytest

from pdhocbf_drake.cli import main
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.importing.finding import find_model
from pdhocbf_drake.simulation.scenario_file import load_scenario

WRITTEN = {"robot.yaml", "walking.yaml", "import.html", "model.urdf"}


@pytest.fixture
def model(elsewhere: Path) -> Path:
    path = elsewhere / "mine.urdf"
    path.write_text(bipeds.urdf(bipeds.Shape()))
    return path


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_it_writes_a_folder(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["import", str(model), "--out", "bot"]) == 0
    assert names(Path("bot")) == WRITTEN
    output = capsys.readouterr()
    assert "left sole" in output.out
    assert output.out.endswith("next: pdhocbf run bot/walking.yaml\n")
    assert "mine.urdf: reading the model" in output.err
    page = Path("bot/import.html").read_text()
    assert page.count('<img src="data:image/png;base64,') == 1
    for word in ("left_knee_pitch", "four spheres", "the way the knees bend", "half_size: [0.1, 0.06]"):
        assert word in page
    assert load_scenario("bot/walking.yaml").robot == str(Path("bot/robot.yaml").resolve())


def test_nothing_is_overwritten_without_being_asked(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["import", str(model), "--out", "bot"]) == 0
    Path("bot/robot.yaml").write_text("mine")
    assert main(["import", str(model), "--out", "bot"]) == 1
    assert capsys.readouterr().err.endswith(
        "pdhocbf: bot is not empty; give another folder with --out, or --force to import anew\n"
    )
    assert Path("bot/robot.yaml").read_text() == "mine"
    assert main(["import", str(model), "--out", "bot", "--force"]) == 0
    assert Path("bot/robot.yaml").read_text() != "mine"
    Path("bot/notes.txt").write_text("mine")
    assert main(["import", str(model), "--out", "bot", "--force"]) == 1
    assert "not an imported robot, since it holds notes.txt" in capsys.readouterr().err
    assert main(["import", str(model), "--out", ".", "--force"]) == 1
    assert "pdhocbf: . holds the model itself" in capsys.readouterr().err


def test_a_model_that_is_refused_leaves_nothing(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model.write_text(model.read_text().replace('type="revolute"', 'type="fixed"'))
    assert main(["import", str(model), "--out", "bot"]) == 1
    assert capsys.readouterr().err.count("\n") <= 4
    assert names(Path()) == {"mine.urdf"}


def test_the_folder_has_the_models_name(model: Path) -> None:
    assert main(["import", str(model)]) == 0
    assert names(Path("mine")) == WRITTEN


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--left-joints", "a,b"], "six names are needed, hip_yaw, hip_roll, hip_pitch, knee_pitch, ankle_pitch, "),
        (["--fix", "arm"], "JOINT=ANGLE is needed; given: 'arm'"),
        (["--effort", "-3"], "must be above 0 and up to 1e+06 N m; given: '-3'"),
        (["--package", "a=nowhere"], "NAME=DIR with a folder that is there is needed; given: 'a=nowhere'"),
        (["--forward", "up"], "invalid choice: 'up'"),
    ],
)
def test_flags_that_say_nothing(model: Path, words: list[str], says: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["import", str(model), *words])
    assert ended.value.code == 2
    assert says in capsys.readouterr().err


def test_joints_of_one_leg_alone(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["import", str(model), "--left-joints", "a,b,c,d,e,f"]) == 1
    assert capsys.readouterr().err == "pdhocbf: --left-joints and --right-joints are needed both, or none\n"


def test_a_model_that_is_not_there(elsewhere: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["import", "gone.urdf"]) == 1
    assert capsys.readouterr().err == "pdhocbf: there is no model file 'gone.urdf'\n"
    Path("notes.txt").write_text("")
    assert main(["import", "notes.txt"]) == 1
    assert capsys.readouterr().err == (
        "pdhocbf: notes.txt is no model: a file ending in .urdf, .sdf, .xml, .mjcf is needed\n"
    )
    assert main(["import", "nobody_knows_it"]) == 1
    assert "pdhocbf: no model 'nobody_knows_it': give a URDF, SDF or MJCF file, or a name of a package; " in (
        capsys.readouterr().err
    )


@pytest.mark.parametrize("name", ["walker", "walker_v1.legsOnly"])
def test_a_name_of_a_package_of_models(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A package as pip installs it: its files are listed in RECORD."""
    place = tmp_path / "cmeel.prefix" / "share" / "robots" / f"{name}.urdf"
    place.parent.mkdir(parents=True)
    place.write_text(bipeds.urdf(bipeds.Shape()))
    about = tmp_path / "example_robot_data-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: example-robot-data\nVersion: 1.0\n")
    (about / "RECORD").write_text(f"cmeel.prefix/share/robots/{name}.urdf,,\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert find_model(name) == place.resolve()
    with pytest.raises(InputError, match=f"no model 'runner.v1': give .* example-robot-data has {re.escape(name)}$"):
        find_model("runner.v1")


def test_a_name_that_has_to_be_downloaded_without_a_network(
    elsewhere: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Modules of robot_descriptions clone a repository as they are imported, and raise what git says."""
    package = elsewhere / "robot_descriptions"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "far_description.py").write_text(
        "error = RuntimeError('Cmd failed')\n"
        "error.stderr = \"\\n  stderr: 'Cloning\\nfatal: unable to access: Could not resolve host'\"\nraise error\n"
    )
    (package / "bare_description.py").write_text("import a_library_of_git\n")
    monkeypatch.syspath_prepend(str(elsewhere))
    monkeypatch.delitem(sys.modules, "robot_descriptions", raising=False)
    assert main(["import", "far_description"]) == 1
    assert capsys.readouterr().err == (
        "pdhocbf: robot_descriptions can't download 'far_description', for which it needs a network: "
        "unable to access: Could not resolve host\n"
    )
    assert main(["import", "bare_description"]) == 1
    assert capsys.readouterr().err == (
        "pdhocbf: robot_descriptions needs the package 'a_library_of_git', which is not installed\n"
    )
    assert main(["import", "nobody_knows_it"]) == 1
    assert "pdhocbf: no model 'nobody_knows_it': give a URDF" in capsys.readouterr().err
    assert names(elsewhere) == {"robot_descriptions"}


def test_a_missing_library_is_named(
    model: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("shell.stl").write_text("solid shell\nendsolid shell\n")
    mesh = '<visual><geometry><mesh filename="shell.stl"/></geometry></visual></link>'
    model.write_text(model.read_text().replace("</link>", mesh, 1))
    monkeypatch.setitem(sys.modules, "trimesh", None)
    assert main(["import", str(model), "--out", "bot"]) == 1
    assert capsys.readouterr().err.endswith(
        "pdhocbf: meshes are converted with the packages 'trimesh', 'fast-simplification' and 'pycollada'; "
        "install them with pip install '.[import]' in this package's repository\n"
    )
