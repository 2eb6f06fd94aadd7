"""The numbers of the benchmark as text, and its two plots: the time of a tick by route, and its growth."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from matplotlib.figure import Figure

from pdhocbf_drake.analysis.drawing import panels, styled
from pdhocbf_drake.analysis.palette import LIMIT, RUNS
from pdhocbf_drake.terminal import table

_WANTED: dict[str, tuple[str, Callable[[float], bool]]] = {
    "stock_over_ours_nominal": ("≥ 20", lambda x: x >= 20),
    "stock_over_ours_perturbed": ("≥ 14", lambda x: x >= 14),
    "ours_over_core": ("≤ 6", lambda x: x <= 6),
    "p99_over_median": ("≤ 4", lambda x: x <= 4),
    "robot_over_bare_plant": ("≤ 1.8", lambda x: x <= 1.8),
    "template_real_time_factor": ("≥ 100", lambda x: x >= 100),
    "robot_real_time_factor": ("≥ 7", lambda x: x >= 7),
    "estimator_over_mpc_tick": ("≤ 3", lambda x: x <= 3),
    "start_over_import": ("≤ 3", lambda x: x <= 3),
}


def report(results: dict[str, Any]) -> str:
    """All tables, one below the other."""
    sections = {
        "A tick of x and y, by route [µs]": _route_table,
        "Accuracy against a reference of 1e-12": _accuracy,
        "The parts of a tick of ours [µs]": _parts,
        "The walking robot's loop, and what is left of it without Python [µs a tick]": _loops,
        "The parts of a tick, block by block, plant step 1 ms [µs]": _blocks,
        "The same walk at longer plant steps": _plant_steps,
        "Growth": _growth_table,
        "Ratios": _ratios,
    }
    return "\n\n".join(f"{title}\n{body(results)}" for title, body in sections.items())


def _route_table(results: dict[str, Any]) -> str:
    nominal, perturbed = results["ticks"]["nominal"], results["ticks"]["perturbed"]
    rows = []
    for name in nominal:
        times = [1e6 * run[name][key] for run in (nominal, perturbed) for key in ("seconds_median", "seconds_p99")]
        rows.append([name, *times, int(nominal[name]["ticks"])])
    return table(rows, ["route", "nominal", "p99", "perturbed", "p99", "ticks"])


def _accuracy(results: dict[str, Any]) -> str:
    found = results["accuracy"]
    rows = [[name, row["relative_gap_max"], row["violation_max"]] for name, row in found["routes"].items()]
    text = table(rows, ["route", "relative cost gap", "violation"])
    exits = ", ".join(f"{count} {name}" for name, count in found["exits"].items() if count) or "none"
    return (
        f"{text}\n{found['references_certain']} of {found['references']} references met their own tolerance; "
        f"exits that are not optimal in {found['ticks_of_exits']} perturbed ticks: {exits}"
    )


def _parts(results: dict[str, Any]) -> str:
    whole = results["rest"]["whole"]
    rows = [[name, 1e6 * seconds, seconds / whole] for name, seconds in results["rest"].items()]
    return table(rows, ["part", "µs", "share"])


def _loops(results: dict[str, Any]) -> str:
    names = ("loop", "blocks", "replayed_plant", "bare_plant")
    rows = [
        [f"{1e3 * robot['plant_step']:g} ms", *(1e6 * robot[f"{name}_seconds_per_tick"] for name in names)]
        for robot in (results["robot"], results["robot_at_5_ms"])
    ]
    return table(rows, ["plant step", "one block", "block by block", "from a recording", "standing"])


def _blocks(results: dict[str, Any]) -> str:
    robot = results["robot"]
    whole = sum(robot["blocks"].values())
    rows = [[name, 1e6 * seconds, seconds / whole] for name, seconds in robot["blocks"].items()]
    text = table([*rows, ["all", 1e6 * whole, 1.0]], ["block", "µs", "share"])
    own = 1e6 * robot["kinematics_seconds_per_tick"]
    count = robot["python_calls_per_tick"]
    return f"{text}\n{count:.0f} calls from Python a tick; kinematics and dynamics of the robot take {own:.0f} µs of it"


def _plant_steps(results: dict[str, Any]) -> str:
    rows = [
        [
            f"{1e3 * row['plant_step']:g} ms", row["same_walk"], row["mean_speed"], row["h_min"],
            row["zmp_outside_fraction"], 1e3 * row["controller_seconds_per_tick"], 1e3 * row["plant_seconds_per_tick"],
            row["real_time_factor"],
        ]
        for row in results["plant_steps"]
    ]  # fmt: skip
    head = ["plant step", "same walk", "speed [m/s]", "h_min [m/s]", "ZMP outside", "controller [ms]", "plant [ms]"]
    return table(rows, [*head, "times real time"])


def _growth_table(results: dict[str, Any]) -> str:
    rows = [
        [row["horizon"], row["ticks_per_gait"], 1e6 * row["tick_seconds_median"], row["start_seconds"]]
        for row in results["growth"]
    ]
    text = table(rows, ["horizon", "gait", "tick [µs]", "start [s]"])
    grown = results["resident_growth_bytes"] / 1e6
    power = f"growth with the horizon: H^{results['growth_exponent']:.2f}"
    return f"{text}\n{power}; resident set grew by {grown:.2f} MB in the walk"


def _ratios(results: dict[str, Any]) -> str:
    rows = []
    for name, value in results["ratios"].items():
        wanted, met = _WANTED.get(name, ("", bool))
        rows.append([name, value, wanted, met(value) if wanted else ""])
    template = results["template"]
    share = f"of the template loop's time {100 * template['framework_share']:.0f} % is the framework's"
    floor = results["robot"]["replayed_over_bare_plant"]
    least = f"no controller at all, the plant walking from a recording: {floor:.3g} times the bare plant"
    started = results["start_up"]
    prepared = started["prepared_seconds"] / started["import_drake_seconds"]
    late = f"start-up with the programs of a disturbed walk compiled as well: {prepared:.3g} times the import"
    return "\n".join([table(rows, ["ratio", "measured", "wanted", "met"]), share, least, late])


def draw(results: dict[str, Any]) -> dict[str, Figure]:
    """The figures by name."""
    with styled():
        return {"routes": _routes(results), "growth": _growth(results)}


def _routes(results: dict[str, Any]) -> Figure:
    figure, (axes,) = panels(1, height=3.1, width=7.5)
    names = list(results["ticks"]["nominal"])
    for offset, (run, colour) in enumerate(zip(("nominal", "perturbed"), RUNS, strict=False)):
        times = [results["ticks"][run][name] for name in names]
        places = [i + 0.36 * (offset - 0.5) for i in range(len(names))]
        medians = [1e6 * each["seconds_median"] for each in times]
        above = [max(0.0, 1e6 * (each["seconds_p99"] - each["seconds_median"])) for each in times]
        axes.barh(places, medians, 0.34, xerr=[[0.0] * len(names), above], color=colour, label=f"{run} (to p99)")
    axes.set_xscale("log")
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.grid(axis="y", visible=False)
    axes.set_xlabel("time of a tick, x and y [µs]")
    axes.legend()
    return figure


def _growth(results: dict[str, Any]) -> Figure:
    figure, (axes,) = panels(1, height=3.1, width=5.5)
    times: dict[int, list[tuple[int, float]]] = {}
    for row in results["growth"]:
        times.setdefault(row["ticks_per_gait"], []).append((row["horizon"], 1e6 * row["tick_seconds_median"]))
    for gait, colour in zip(sorted(times), RUNS, strict=False):
        axes.plot(*zip(*sorted(times[gait]), strict=True), "o-", color=colour, label=f"gait of {gait} ticks")
    points = sorted(point for gait in times.values() for point in gait)
    (first, least), (last, _) = points[0], points[-1]
    axes.plot([first, last], [least, least * (last / first) ** 2], ":", color=LIMIT, label="H²")
    axes.set(xscale="log", yscale="log", xlabel="horizon H [ticks]", ylabel="time of a tick [µs]")
    axes.legend()
    return figure
