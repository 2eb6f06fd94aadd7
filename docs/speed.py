"""Writes the measured tables of speed.md: `pdhocbf bench --json bench.json`, then `python docs/speed.py bench.json`."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

PAGE = Path(__file__).parent / "speed.md"
Rows = list[list[str]]


def first_rows(bench: dict[str, Any]) -> Rows:
    """What a user asks first."""
    calm, start = bench["ticks"]["nominal"]["ours"], bench["start_up"]
    steps = [row for row in bench["plant_steps"] if row["plant_step"] in (0.001, 0.005)]
    loop = "the robot's loop, times real time, at a plant step of"
    return [
        ["", "measured"],
        *([f"{loop} {1e3 * row['plant_step']:g} ms", f"{row['real_time_factor']:.2g}"] for row in steps),
        ["the template's loop, times real time", f"{bench['template']['real_time_factor']:.2g}"],
        ["a tick of the MPC, x and y, median [µs]", _micro(calm["seconds_median"])],
        ["the same, 99 % are below [µs]", _micro(calm["seconds_p99"])],
        [
            "from the start of Python to a walk that is ready, nothing kept from before [s]",
            f"{start['ready_seconds']:.2f}",
        ],
        ["of that the import of Drake [s]", f"{start['import_drake_seconds']:.2f}"],
        ["growth of the resident set in a minute of walking [MB]", f"{bench['resident_growth_bytes'] / 1e6:.2f}"],
    ]


def ratio_rows(bench: dict[str, Any]) -> Rows:
    """Our way of solving against others, accuracy, growth."""
    ratios, found, power = bench["ratios"], bench["accuracy"], bench["growth_exponent"]
    return [
        ["", "measured"],
        ["stock Drake (Clarabel, rebuilt each tick) ÷ ours, nominal", f"{ratios['stock_over_ours_nominal']:.0f}"],
        ["the same, perturbed", f"{ratios['stock_over_ours_perturbed']:.0f}"],
        ["ours ÷ (DAQP's own clock and one sparse product)", f"{ratios['ours_over_core']:.2g}"],
        ["99th percentile ÷ median of ours, perturbed", f"{ratios['p99_over_median']:.2g}"],
        [
            "relative cost gap, violation, at the worst tick",
            f"{found['relative_gap_max']:.0e}, {found['violation_max']:.0e}",
        ],
        [f"exits that are not optimal in {found['ticks_of_exits']:,} perturbed ticks", str(found["non_optimal_exits"])],
        ["growth of a tick with the horizon, 80 to 320 ticks", "–" if power is None else f"H^{power:.2f}"],
    ]


def floor_rows(bench: dict[str, Any]) -> Rows:
    """The robot's loop, and what is left of it without Python."""
    names = "loop", "blocks", "replayed_plant", "bare_plant"
    head = [
        "plant step",
        "one block",
        "block by block",
        "walking from a recording",
        "standing",
        "recording ÷ one block",
    ]
    rows = [
        [
            f"{1e3 * robot['plant_step']:g} ms",
            *(_micro(robot[f"{name}_seconds_per_tick"]) for name in names),
            f"{robot['replayed_over_robot']:.2f}",
        ]
        for robot in (bench["robot"], bench["robot_at_5_ms"])
    ]
    return [head, *rows]


def block_rows(bench: dict[str, Any]) -> Rows:
    """The parts of a tick, block by block."""
    return [["block", "µs a tick"], *([name, _micro(t)] for name, t in bench["robot_at_5_ms"]["blocks"].items())]


def step_rows(bench: dict[str, Any]) -> Rows:
    """The walk at several plant steps."""
    head = ["plant step", "the same walk", "speed [m/s]", "least h [mm/s]", "ZMP outside its box", "times real time"]
    rows = [
        [
            f"{1e3 * row['plant_step']:g} ms", "yes" if row["same_walk"] else "no", f"{row['mean_speed']:.3f}",
            f"{1e3 * row['h_min']:.0f}", f"{100 * row['zmp_outside_fraction']:.1f} %", f"{row['real_time_factor']:.2g}",
        ]
        for row in bench["plant_steps"]
    ]  # fmt: skip
    return [head, *rows]


TABLES = {"first": first_rows, "ratios": ratio_rows, "floor": floor_rows, "blocks": block_rows, "steps": step_rows}


def with_tables(text: str, bench: dict[str, Any]) -> str:
    """The page with its tables renewed between their marks."""
    for name, rows_of in TABLES.items():
        head, *rows = rows_of(bench)
        lines = [head, ["---"] * len(head), *rows]
        table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
        mark = re.compile(f"(<!-- {name} -->\n).*?(<!-- end of {name} -->)", re.DOTALL)
        text = mark.sub(lambda m, table=table: f"{m[1]}\n{table}\n\n{m[2]}", text)  # type: ignore[misc]
    return text


def _micro(seconds: float) -> str:
    return f"{1e6 * seconds:.0f}"


if __name__ == "__main__":
    measured = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    PAGE.write_text(with_tables(PAGE.read_text(encoding="utf-8"), measured), encoding="utf-8")
