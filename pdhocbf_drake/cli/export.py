"""`pdhocbf export`: a run's log as CSV and MCAP."""

from __future__ import annotations

import argparse
from pathlib import Path

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.files.places import check_file
from pdhocbf_drake.simulation.run_folder import CSV, MCAP, read_run
from pdhocbf_drake.terminal import say


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A run, the formats, and where to write."""
    parser.add_argument("run", type=Path, metavar="RUN")
    parser.add_argument("--csv", action="store_true", help="write CSV; without --csv and --mcap both are written")
    parser.add_argument("--mcap", action="store_true", help="write MCAP, which PlotJuggler and Foxglove open")
    where = f"a folder, or a file ending in .csv or .mcap; otherwise {CSV} and {MCAP} in the run folder"
    parser.add_argument("--out", type=Path, metavar="PATH", help=where)


def run(options: argparse.Namespace) -> int:
    """Writes the files and prints where they are; without the extra `export`, CSV alone unless MCAP is asked for."""
    recorded, places = read_run(options.run), _places(options)
    from pdhocbf_drake.analysis.export import MISSING_MCAP, check_new, write_csv, write_mcap  # here, as in `replay`

    writers = {".csv": write_csv, ".mcap": write_mcap}
    for place in places:
        check_new(place)
        check_file(place)
    for place in places:
        try:
            writers[place.suffix](recorded, place)
        except InputError as error:
            if options.mcap or len(places) == 1 or str(error) != MISSING_MCAP:
                raise
            say(f"pdhocbf: {error}")
        else:
            print(place)
    return 0


def _places(options: argparse.Namespace) -> list[Path]:
    """The files to write, CSV before MCAP."""
    chosen = {".csv": options.csv, ".mcap": options.mcap}
    suffixes = [suffix for suffix, wanted in chosen.items() if wanted] or list(chosen)
    out: Path | None = options.out
    if out is None or out.suffix not in chosen or out.is_dir():
        return [(options.run if out is None else out) / {".csv": CSV, ".mcap": MCAP}[suffix] for suffix in suffixes]
    if (options.csv or options.mcap) and suffixes != [out.suffix]:
        asked = " and ".join(f"--{suffix[1:]}" for suffix in suffixes)
        raise InputError(f"--out {out} is one {out.suffix[1:].upper()} file, which does not fit {asked}; give a folder")
    return [out]
