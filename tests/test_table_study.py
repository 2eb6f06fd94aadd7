"""Studies as tables: what is planned and refused, how pieces become a table, and its folder, on rows of numbers."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import NamedTuple

import pytest

from pdhocbf_drake.errors import InputError, PdhocbfError
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.directions.command import STUDY as DIRECTIONS
from pdhocbf_drake.studies.ground.command import STUDY as GROUND
from pdhocbf_drake.studies.limits.command import STUDY as LIMITS
from pdhocbf_drake.studies.sensing.command import STUDY as SENSING
from pdhocbf_drake.studies.shared.check_table import table
from pdhocbf_drake.studies.shared.checks import Outcome, combined, least, most
from pdhocbf_drake.studies.shared.row_kinds import Asked, Table
from pdhocbf_drake.studies.shared.table_study import Number, TableStudy

ALL = pytest.mark.parametrize("study", [DIRECTIONS, GROUND, LIMITS, SENSING], ids=lambda study: study.name)


class Piece(NamedTuple):
    """A number to measure."""

    row: str
    value: float
    folder: str | None = None


class Numbers:
    """Rows whose pieces are the numbers 1 to N times that of the row; a negative one can't be measured."""

    def __init__(self, factor: float) -> None:
        self.factor = factor

    def plan(self, row: str, asked: Asked) -> list[Piece]:
        return [Piece(row, self.factor * (i + 1)) for i in range(asked.numbers["walks"])]

    def measure(self, work: Piece) -> Outcome:
        if work.value < 0.0:
            raise PdhocbfError("a negative number")
        if work.folder is not None:
            (Path(work.folder) / work.row).mkdir(exist_ok=True)
        return Outcome([most(work.row, "number", work.value, 3.0)], [f"{work.row} {work.value:g}"])


def study(table: Table, walk_folders: bool = False) -> TableStudy:
    number = Number("walks", 3, 1, "numbers of each row", quick=2)
    return TableStudy(
        "numbers", "such as one", "two of each", lambda: table, numbers=[number], walk_folders=walk_folders
    )


ROWS = Table({"one": Numbers(1.0), "two": Numbers(2.0), "slow": Numbers(0.5)}, unless_quick=["slow"])


# Checks.


@pytest.mark.parametrize(("make", "kept", "missed"), [(most, 1.0, 1.1), (least, 1.0, 0.9)])
def test_a_check_holds_up_to_its_limit_and_not_without_a_value(make, kept: float, missed: float) -> None:
    assert make("row", "what", kept, 1.0).holds
    assert not make("row", "what", missed, 1.0).holds
    assert not make("row", "what", None, 1.0).holds
    assert not make("row", "what", math.nan, 1.0).holds


def test_several_walks_are_judged_by_their_worst_sum_or_mean() -> None:
    sums = [most("a", "falls", value, 0.0)._replace(combine="sum") for value in (0.0, 2.0, 1.0)]
    means = [least("a", "safe", value, 99.0)._replace(combine="mean") for value in (98.0, 100.0)]
    worst = [least("b", "gap", value, 10.0) for value in (12.0, 11.0)] + [
        most("b", "error", v, 5.0) for v in (1.0, 4.0)
    ]
    found = combined([*sums, *means, *worst])
    assert [(c.what, c.value) for c in found] == [("falls", 3.0), ("safe", 99.0), ("gap", 11.0), ("error", 4.0)]
    assert math.isnan(combined([most("b", "error", 1.0, 5.0), most("b", "error", None, 5.0)])[0].value)


def test_what_is_missed_is_shown_and_so_are_notes() -> None:
    text = table([most("row", "one", 2.0, 1.0), most("row", "other", 1.0, 1.0)], ["sequence 3 fell"])
    assert [line.endswith(word) for line, word in zip(text.splitlines()[2:4], ("NO", "yes"), strict=True)] == [True] * 2
    assert text.endswith("sequence 3 fell")


# Plans.


def test_a_quick_table_has_fewer_rows_and_pieces_unless_a_row_is_named() -> None:
    scenario, numbers = load_scenario("walking"), study(ROWS)
    assert [piece.row for piece in numbers.plan(scenario)] == ["one"] * 3 + ["two"] * 3 + ["slow"] * 3
    assert [piece.row for piece in numbers.plan(scenario, quick=True)] == ["one"] * 2 + ["two"] * 2
    assert [piece.row for piece in numbers.plan(scenario, ["slow", "slow"], quick=True)] == ["slow"] * 2
    assert [piece.value for piece in numbers.plan(scenario, ["two"], quick=True, walks=1)] == [2.0]


def test_the_order_of_the_work_may_be_another_one_than_that_of_the_table() -> None:
    table = Table(ROWS.kinds, always=["two"], order=lambda piece: -piece.value)
    pieces = study(table).plan(load_scenario("walking"), ["one"])
    assert [(piece.row, piece.value) for piece in pieces[:3]] == [("two", 6.0), ("two", 4.0), ("one", 3.0)]


@ALL
@pytest.mark.parametrize(
    ("scenario", "changes", "rows", "message"),
    [
        ("walking", "", ["spiral"], r"^rows: some of .*; .* are needed \(given: 'spiral'\)$"),
        ("walking", "", [], r"^rows: some of .*; .* are needed \(given: none\)$"),
        (
            "walking",
            "gait: {walk_steps: 3}",
            None,
            r"^scenario 'walking': a walk of a robot .*without an end",
        ),
        ("walking", "commands: [{time: 0, turn: 0.1}]", None, "commands: must be empty here"),
        ("vhip", "", None, r"^scenario 'vhip': a walk of a robot .*without an end is needed \(system: biped, "),
    ],
)
def test_a_table_that_cannot_be_made_is_refused(
    study: TableStudy, scenario: str, changes: str, rows: list[str] | None, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        study.plan(load_scenario(scenario, changes), rows)


@ALL
def test_numbers_below_their_least_are_refused(study: TableStudy) -> None:
    for number in study.numbers:
        with pytest.raises(InputError, match=rf"^{number.name} must be {number.least} or more \(given: -1\)$"):
            study.plan(load_scenario("walking"), quick=True, **{number.name: -1})


def test_what_a_table_needs_of_its_scenario_is_said() -> None:
    with pytest.raises(InputError, match=r"on flat ground without an end is needed \(.*, ground: \[\]\)$"):
        GROUND.plan(load_scenario("walking_stairs"))
    with pytest.raises(InputError, match=r"\(system: biped, gait.walk_steps: null, a gait.stride\)$"):
        SENSING.plan(load_scenario("walking", "gait: {stride: 0.0}"))


# Results.


def test_pieces_become_a_table_and_a_folder(tmp_path: Path) -> None:
    done: list[int] = []
    checks, notes = study(ROWS, walk_folders=True).measured(
        load_scenario("walking"), rows=["two", "one"], out=tmp_path / "out", progress=done.append
    )
    assert [(check.row, check.value, check.holds) for check in checks] == [("one", 3.0, True), ("two", 6.0, False)]
    assert notes == ["one 1", "one 2", "one 3", "two 2", "two 4", "two 6"]
    assert done == [1, 2, 3, 4, 5, 6]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "numbers.json", "numbers.txt", "one", "scenario.yaml", "two",
    ]  # fmt: skip
    data = json.loads((tmp_path / "out" / "numbers.json").read_text(encoding="utf-8"))
    assert (data["scenario"], data["holds"], data["notes"]) == ("walking", False, notes)


def test_what_was_measured_before_an_error_is_in_the_folder(tmp_path: Path) -> None:
    wrong = study(Table({"one": Numbers(1.0), "wrong": Numbers(-1.0)}))
    with pytest.raises(PdhocbfError, match=r"^a negative number; 3 of 6 pieces of the table are in .*out$"):
        wrong.measured(load_scenario("walking"), out=tmp_path / "out")
    data = json.loads((tmp_path / "out" / "numbers.json").read_text(encoding="utf-8"))
    assert [check["row"] for check in data["checks"]] == ["one"]


def test_the_verb_takes_rows_and_numbers_and_writes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    numbers, parser = study(ROWS, walk_folders=True), argparse.ArgumentParser()
    numbers.add_arguments(parser)
    out = str(tmp_path / "out")
    words = ["walking", "--rows", "two, slow", "--walks", "1", "--workers", "1", "--out", out]
    assert numbers.run(parser.parse_args(words)) == 0
    said = capsys.readouterr().out
    assert (tmp_path / "out" / "numbers.txt").read_text(encoding="utf-8").strip() in said
    assert said.endswith(f"wrote {out}/numbers.json\nthe run folders of single walks are beside it\n")
    with pytest.raises(InputError, match=r"^workers must be 1 to 1024"):
        numbers.run(parser.parse_args(["walking", "--workers", "0"]))
