"""Walks over ground that is on no map: boards, tiles, single steps, slopes and patches of low friction."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.ground.measures import sensors, survived
from pdhocbf_drake.studies.shared.checks import Outcome
from pdhocbf_drake.studies.shared.row_kinds import Asked
from pdhocbf_drake.studies.shared.work import Work, fallen, walked

_FIRST = 0.6  # x at which unknown ground begins [m]
_LENGTH = 3.0  # of it [m]
_PHASES = 8  # of a gait of two steps, at which an edge is met


class Unknown(NamedTuple):
    """A piece of ground, and how many of its walks must not fall.

    Attributes:
        piece: the piece, without its place and seed.
        walks: how many: "draws" of random ground, or "phases" of the gait.
        share: of the walks that must reach the end.
        length: of the ground that is walked on after its beginning [m].
        sensed: whether on the sensors' estimate.
    """

    piece: Mapping[str, Any]
    walks: str
    share: float
    length: float = _LENGTH
    sensed: bool = False


def _random(kind: str, size: str, length: float, amplitude: float) -> dict[str, Any]:
    return {"kind": kind, size: length, "amplitude": amplitude}


def _step(rise: float) -> dict[str, Any]:
    return {"kind": "stairs", "rise": rise, "tread": 10.0, "count": 1}


_AFTER = 0.9  # walked after a single step [m]
ROWS: Final = {
    "boards 0.01": Unknown(_random("boards", "length", 0.3, 0.01), "draws", 30 / 30),
    "boards 0.02": Unknown(_random("boards", "length", 0.3, 0.02), "draws", 15 / 30),
    "tiles 0.005": Unknown(_random("rough", "size", 0.1, 0.005), "draws", 27 / 30),
    "tiles 0.01": Unknown(_random("rough", "size", 0.1, 0.01), "draws", 18 / 30),
    "one step down 0.02": Unknown(_step(-0.02), "phases", 8 / 8, _AFTER),
    "one step down 0.03": Unknown(_step(-0.03), "phases", 0 / 8, _AFTER),
    "one step up 0.01": Unknown(_step(0.01), "phases", 6 / 8, _AFTER),
    "unknown slope up 4": Unknown({"kind": "slope", "length": 10.0, "angle_deg": 4.0}, "phases", 8 / 8),
    "unknown slope down 4": Unknown({"kind": "slope", "length": 10.0, "angle_deg": -4.0}, "phases", 8 / 8),
    "friction 0.3": Unknown({"kind": "patch", "friction": 0.3}, "phases", 8 / 8, 1.0),
    "friction 0.15": Unknown({"kind": "patch", "friction": 0.15}, "phases", 8 / 8, 1.0),
    "boards 0.01 by sensors": Unknown(_random("boards", "length", 0.3, 0.01), "draws", 27 / 30, sensed=True),
}


def plan(row: str, asked: Asked) -> list[Work]:
    """A walk for each draw, or for each phase."""
    count, seed = asked.numbers["walks"], asked.numbers["seed"]
    walks = min(count, _PHASES) if ROWS[row].walks == "phases" else count
    return [Work(row, asked.scenario, {"seed": seed, "draw": draw}) for draw in range(walks)]


def measure(work: Work) -> Outcome:
    """Walks over one draw of the row's ground."""
    unknown, draw, scenario = ROWS[work.row], int(work.setting["draw"]), scenario_of(work)
    log, metrics = walked(scenario)
    found = survived(work.row, unknown.share, scenario, log)
    return Outcome(found, [f"{sentence}, {_cause(log)}" for sentence in fallen(f"{work.row}, walk {draw}", metrics)])


def scenario_of(work: Work) -> Scenario:
    """The walk of a piece of work."""
    unknown, seed, draw = ROWS[work.row], int(work.setting["seed"]), int(work.setting["draw"])
    scenario = Scenario.model_validate_json(work.scenario)
    gait = scenario.gait
    two_steps = 2.0 * abs(gait.stride)
    phased = unknown.walks == "phases"
    first = round(_FIRST + (two_steps * draw / _PHASES if phased else 0.0), 4)
    piece = {**unknown.piece, "known": False}
    if piece["kind"] in ("stairs", "slope"):
        piece["at"] = first
    else:
        piece |= {"from": first, "to": round(first + unknown.length, 4)}
    if not phased:
        piece["seed"] = int(np.random.SeedSequence([seed, draw]).generate_state(1)[0])
    steps = (first + unknown.length + 2.0 * two_steps) / abs(gait.stride) + gait.start_steps
    changes: dict[str, Any] = {"ground": [piece], "duration": round(steps * gait.ticks_per_step * gait.tick, 3)}
    if unknown.sensed:
        changes["measurement"] = sensors(draw)
    return work.with_keys(**changes)


def _cause(log: RunLog) -> str:
    """What came first of a fall: how the last step before it met the ground."""
    step, support = log.element("gait_phase", "step"), log.element("gait_phase", "support")
    tick = log.element("gait_phase", "tick")
    last = step[-1] - 1.0
    rows = (step == last) & (support != 0.0)
    if not rows.any():
        return "while it stood"
    foot = 0 if support[rows][-1] > 0.0 else 1
    loads = log["foot_load"][:, foot]
    early = (step == last - 1.0) & (tick > 0.5 * tick.max()) & (loads > 0.0)
    if early.any():
        return (
            f"after its foot met the ground {int((tick.max() + 1 - tick[early]).max())} ticks early in the step before"
        )
    met = tick[rows & (loads > 0.0)]
    late = int(met.min()) if len(met) else int(tick.max())
    return f"after its foot met the ground {late} ticks late in the step before"
