"""Studies whose result is a table of what walks must reach: of one description a plan, the results and a verb."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from pdhocbf_drake.arguments import add_scenario, add_work
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.shared.checks import Check
from pdhocbf_drake.studies.shared.pool import check_workers
from pdhocbf_drake.studies.shared.row_kinds import Asked, Table, entry
from pdhocbf_drake.terminal import shown_progress


class Number(NamedTuple):
    """A whole number that is asked of the user: how many walks, or a seed.

    Attributes:
        name: of the argument.
        default, least: its default and its least value.
        help: of the command line.
        quick: its largest value in a quick table; None leaves it.
    """

    name: str
    default: int
    least: int
    help: str
    quick: int | None = None


@dataclass(frozen=True)
class TableStudy:
    """A study of walks beside what they must reach, and its verb `pdhocbf NAME`.

    Attributes:
        name: of the verb and of its files.
        some: how rows are named on the command line, as an example.
        quick: what a quick table leaves out.
        load: gives the table; it may load Drake.
        separator: of rows on the command line.
        numbers: what is asked of the user besides.
        walk_folders: whether rows that are a single walk keep its run folder, where the table isn't quick.
    """

    name: str
    some: str
    quick: str
    load: Callable[[], Table]
    separator: str = ","
    numbers: Sequence[Number] = ()
    walk_folders: bool = False

    def plan(
        self, scenario: Scenario, rows: Sequence[str] | None = None, quick: bool = False, **numbers: int
    ) -> list[Any]:
        """The pieces of work; the arguments are those of `measured`. Raises `InputError`."""
        table = self.load()
        table.check(scenario)
        known = list(table.kinds)
        left_out = table.unless_quick if quick else ()
        chosen = [row for row in known if row not in left_out] if rows is None else list(rows)
        if unknown := [repr(row) for row in chosen if row not in known] or ([] if chosen else ["none"]):
            raise InputError(f"rows: some of {'; '.join(known)} are needed (given: {unknown[0]})")
        asked = Asked(scenario.model_dump_json(), quick, self._given(quick, numbers), table.prepare(scenario))
        wanted = dict.fromkeys([*table.always, *chosen])
        work = [piece for row in wanted for piece in table.kinds[row].plan(row, asked)]
        return work if table.order is None else sorted(work, key=table.order)

    def measured(
        self,
        scenario: Scenario,
        *,
        rows: Sequence[str] | None = None,
        quick: bool = False,
        workers: int = 1,
        out: str | Path | None = None,
        progress: Callable[[int], None] | None = None,
        **numbers: int,
    ) -> tuple[list[Check], list[str]]:
        """Walks, and puts what is measured beside what it must reach.

        Args:
            scenario: a walk of the robot without commands; its own barriers are judged.
            rows: some of the table's; None for all, or where quick for all that a quick table has.
            quick: a short version of everything.
            workers: processes; with more than one, the calling script needs `if __name__ == "__main__":`.
            out: a folder for NAME.json, NAME.txt, the scenario, and run folders of single walks; None writes nothing.
            progress: called with the number of pieces of work done so far, of `len(plan(...))`.
            numbers: the study's own, such as how many walks.

        Returns:
            The checks, and sentences on falls and on what was found besides.

        Raises:
            InputError: the scenario is no such walk, or an argument can't be used.
            RunFolderError: `out` can't be written. PdhocbfError: a worker process died, or Ctrl-C ended the work; what
                had been measured is in `out` all the same.
        """
        from pdhocbf_drake.studies.shared.table_work import measured_table

        table, work = self.load(), self.plan(scenario, rows, quick, **numbers)
        entries = [entry(row) for row in table.kinds] if self.walk_folders else []
        keep = self.walk_folders and not quick
        return measured_table(self.name, scenario, table, work, entries, keep, workers, out, progress)

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """A scenario, the rows of the table, numbers, and the folder of the results."""
        add_scenario(parser)
        parser.add_argument("--rows", metavar="LIST", help=f"some of the rows, {self.some}")
        parser.add_argument("--quick", action="store_true", help=self.quick)
        for number in self.numbers:
            parser.add_argument(f"--{number.name}", type=int, default=number.default, metavar="N", help=number.help)
        add_work(parser, self.name)

    def run(self, options: argparse.Namespace) -> int:
        """Walks the rows that are asked for, writes and prints; returns the exit code."""
        scenario = load_scenario(options.scenario, options.text)
        named = None if options.rows is None else options.rows.split(self.separator)
        rows = None if named is None else [row.strip() for row in named if row.strip()]
        check_workers(options.workers)
        folder: Path = options.out or Path("runs") / f"{self.name}-{scenario.name}"
        numbers = {number.name: getattr(options, number.name) for number in self.numbers}
        count = len(self.plan(scenario, rows, options.quick, **numbers))
        from pdhocbf_drake.studies.shared.check_table import table

        with shown_progress(self.name, count, "walks") as progress:
            checks, notes = self.measured(
                scenario, rows=rows, quick=options.quick, workers=options.workers, out=folder,
                progress=lambda done: progress(done), **numbers,
            )  # fmt: skip
        print(table(checks, notes), flush=True)
        print(f"wrote {folder / self.name}.json")
        if self.walk_folders and not options.quick:
            print("the run folders of single walks are beside it")
        return 0

    def _given(self, quick: bool, numbers: Mapping[str, int]) -> dict[str, int]:
        """All numbers, with defaults, as they are used."""
        found = {}
        for number in self.numbers:
            value = numbers.get(number.name, number.default)
            if value < number.least:
                raise InputError(f"{number.name} must be {number.least} or more (given: {value})")
            found[number.name] = min(value, number.quick) if quick and number.quick is not None else value
        return found
