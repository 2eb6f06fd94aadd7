"""A log written as CSV and as MCAP is read again as it was."""

from __future__ import annotations

import builtins
import csv
import json
from pathlib import Path

import numpy as np
import pytest
import synthetic

from pdhocbf_drake.analysis.export import elements_of, write_csv, write_mcap
from pdhocbf_drake.cli import main
from pdhocbf_drake.errors import RunFolderError
from pdhocbf_drake.simulation.run_folder import Run


@pytest.fixture(params=["biped", "vhip", "van_der_pol"])
def run(request: pytest.FixtureRequest) -> Run:
    found = synthetic.run(request.param, duration=2.5)
    found.log.signals["h"][3, 0] = np.nan
    return found


@pytest.fixture
def folder(elsewhere: Path) -> Path:
    place = elsewhere / "run"
    place.mkdir()
    synthetic.run("vhip", duration=2.5).save(place)
    return place


def table_of(run: Run) -> dict[str, np.ndarray]:
    """The log's columns by the names that they have in files."""
    columns = {"time": run.log.time}
    for name, elements in elements_of(run).items():
        columns |= {f"{name}.{element}": run.log[name][:, i] for i, element in enumerate(elements)}
    return columns


def test_elements_have_the_names_of_the_table_of_signals() -> None:
    named = elements_of(synthetic.run("biped", duration=2.5))
    assert named["lip_state"] == ("x", "vx", "x_zmp", "y", "vy", "y_zmp")
    assert named["h"] == ("forward_speed",)
    assert named["actuation"][0] == "left_hip_yaw"
    assert named["robot_state"] == tuple(map(str, range(37)))


def test_csv_is_read_again_bit_for_bit(run: Run, tmp_path: Path) -> None:
    write_csv(run, tmp_path / "log.csv")
    with (tmp_path / "log.csv").open(encoding="utf-8", newline="") as stream:
        header, *rows = csv.reader(stream)
    columns = table_of(run)
    assert header == list(columns)
    np.testing.assert_array_equal(np.array(rows, dtype=float), np.stack(list(columns.values()), axis=1))


def test_mcap_is_read_again_bit_for_bit(run: Run, tmp_path: Path) -> None:
    reader = pytest.importorskip("mcap.reader")
    write_mcap(run, tmp_path / "log.mcap")
    found: dict[str, list[float]] = {}
    times: dict[str, list[float]] = {}
    with (tmp_path / "log.mcap").open("rb") as stream:
        for schema, channel, message in reader.make_reader(stream).iter_messages():
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            assert channel.topic == f"/{schema.name}"
            values = json.loads(message.data)
            assert list(values) == list(json.loads(schema.data)["properties"])
            times.setdefault(schema.name, []).append(message.log_time / 1e9)
            for element, value in values.items():
                found.setdefault(f"{schema.name}.{element}", []).append(np.nan if value is None else value)
    columns = table_of(run)
    del columns["time"]
    assert found.keys() == columns.keys()
    for name, values in columns.items():
        np.testing.assert_array_equal(found[name], values)
    for stamps in times.values():
        np.testing.assert_allclose(stamps, run.log.time, atol=1e-9)


def test_the_verb_writes_both_beside_the_log(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("mcap")
    assert main(["export", str(folder)]) == 0
    assert capsys.readouterr().out.split() == [str(folder / "log.csv"), str(folder / "log.mcap")]
    assert (folder / "log.csv").is_file()
    assert (folder / "log.mcap").is_file()


@pytest.mark.parametrize(
    ("words", "written"),
    [
        (["--csv"], "run/log.csv"),
        (["--mcap"], "run/log.mcap"),
        (["--csv", "--out", "there"], "there/log.csv"),
        (["--out", "there/walk.csv"], "there/walk.csv"),
        (["--mcap", "--out", "walk.mcap"], "walk.mcap"),
    ],
)
def test_format_and_place_can_be_chosen(folder: Path, words: list[str], written: str) -> None:
    pytest.importorskip("mcap")
    assert main(["export", "run", *words]) == 0
    files = {str(path.relative_to(folder.parent)) for path in folder.parent.rglob("*.*") if "log.npz" not in path.name}
    assert files == {"run/scenario.yaml", "run/provenance.json", written}


def test_a_file_that_is_there_is_not_overwritten(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "log.mcap").write_text("mine")
    assert main(["export", str(folder)]) == 1
    assert f"{folder / 'log.mcap'} exists already" in capsys.readouterr().err
    assert (folder / "log.mcap").read_text() == "mine"
    assert not (folder / "log.csv").exists()
    with pytest.raises(RunFolderError, match="exists already"):
        write_csv(synthetic.run("vhip", duration=2.5), folder / "log.mcap")


def test_a_format_against_the_name_of_the_file_is_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(folder), "--mcap", "--out", "walk.csv"]) == 1
    assert "--out walk.csv is one CSV file, which does not fit --mcap" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "code", "written"), [([], 0, {"log.csv"}), (["--mcap"], 1, set()), (["--out", "walk.mcap"], 1, set())]
)
def test_without_the_extra_mcap_is_missed_in_one_sentence(
    folder: Path, words: list[str], code: int, written: set[str],
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    real = builtins.__import__

    def without_mcap(name: str, *arguments: object) -> object:
        if name.startswith("mcap"):
            raise ModuleNotFoundError(f"No module named {name!r}", name="mcap")
        return real(name, *arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(builtins, "__import__", without_mcap)
    assert main(["export", str(folder), *words]) == code
    told = capsys.readouterr().err
    cure = "install it with pip install '.[export]' in this package's repository"
    assert told == f"pdhocbf: MCAP needs the package 'mcap'; {cure}\n"
    assert {path.name for path in folder.glob("*.[cm]*")} == written
