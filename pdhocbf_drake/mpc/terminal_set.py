"""A terminal set for (20f): where the plan must end so that there is a plan at the next tick too."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pdhocbf_drake.barriers.config import BarrierConfig
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.files.file import replaced_file
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.walking.config import GaitConfig


@dataclass(frozen=True)
class TerminalSet:
    """com·(c − f) + velocity·v + step·s + following·v⁺ ≤ bound at the end of a plan.

    c is the CoM, v its velocity, f the stance foot, s the last step of the plan. Most sets hold at the plan's last
    tick k + H and ask nothing of v⁺. That of a hard barrier holds one tick earlier, where v⁺, the velocity at k + H,
    is planned too, because its rows compare the barrier at successive ticks.

    Why a set in (c, v) makes a program with state (c, v, p) recursively feasible: the ZMP p(k + H) acts on the CoM
    only after tick k + H, and its velocity is not limited. So of the plan made at k the last ZMP may still be chosen
    anew at k + 1, and the set promises that some ZMP in the box leads on into the set one tick later. Everything
    else of the old plan stays as it is, footholds included, and is feasible again, provided that the state is where
    it was predicted, that the limits (box, footholds, margin) are those the set was made with, that the barrier is
    soft or the set was made for its rows, and that nothing else is asked of the plan's end: therefore the stability
    condition, which a shifted plan need not meet, is then paid for instead of demanded.

    A set that was made for a disturbance w of a tick has further rows on the state that the plan reaches two ticks on,

        com·(c − f) + velocity·v + step·(f − f₋) + following·v⁺ + coming·(f₊ − f) ≤ bound,

    which is as soon as the ZMP that is chosen now acts: whatever w(k) is, the next state predicted so is in the set,
    and from all of it there is a plan that meets these rows and ends in the set again. So then the program is
    recursively feasible under every w of that box, and the true state stays within the limits.

    Attributes:
        axis: 0 (x) or 1 (y).
        period: ticks after which the set repeats, counted from an even step: N along x, 2N along y.
        rows: com, velocity, step, following [1, s, 1, s] for each phase, shapes (r, 4).
        bounds: [m] for each phase, shapes (r,).
        early: ticks before the plan's end at which the set holds, 0 or 1.
        first, first_bounds: the rows com, velocity, step, following, coming of the plan's tick k + 2 − early and their
            bounds, for each phase of that tick, shapes (r, 5) and (r,); none where no disturbance is withstood.
    """

    axis: int
    rows: tuple[np.ndarray, ...]
    bounds: tuple[np.ndarray, ...]
    early: int = 0
    first: tuple[np.ndarray, ...] = ()
    first_bounds: tuple[np.ndarray, ...] = ()

    @property
    def period(self) -> int:
        """Ticks after which the set repeats."""
        return len(self.rows)

    def at_end_of(self, tick: int) -> tuple[np.ndarray, np.ndarray]:
        """Rows and bounds for plans whose last tick is, after whole periods, the given one."""
        phase = (tick - self.early) % self.period
        return self.rows[phase], self.bounds[phase]

    def violation(self, tick: int, com: float, velocity: float, step: float, following: float = 0.0) -> float:
        """By how much the worst row is broken, ≤ 0 inside [m]; the CoM is taken from the stance foot."""
        phase = tick % self.period
        return float((self.rows[phase] @ [com, velocity, step, following] - self.bounds[phase]).max())


def limits_of(gait: GaitConfig, mpc: MpcConfig, barriers: Mapping[str, BarrierConfig]) -> dict[str, Any]:
    """What a terminal set stands and falls with; barriers do not count where they may be broken at a price."""
    walk = gait.model_dump(exclude={"swing_height", "start_steps", "walk_steps"})
    hard = {name: barrier.model_dump() for name, barrier in barriers.items()} if mpc.barrier == "hard" else None
    plan = mpc.model_dump(include={"step_tolerance", "step_reach", "stance_width_min", "zmp_margin", "robust"})
    # Along y phases are counted from an even step, on which another foot stands where the start has one step more.
    return {**walk, "odd start_steps": gait.start_steps % 2 == 1, **plan, "hard barriers": hard}


def save_terminal_sets(path: Path, sets: Mapping[int, TerminalSet], made_for: Mapping[str, Any]) -> None:
    """Writes sets by axis, and what they are valid for, as an `.npz` that numpy alone can read."""
    columns: dict[str, np.ndarray] = {"made_for": np.array(json.dumps(made_for, sort_keys=True))}
    for axis, terminal in sets.items():
        counts = [len(bounds) for bounds in terminal.bounds]
        columns[f"{'xy'[axis]}_phase"] = np.repeat(np.arange(terminal.period), counts)
        columns[f"{'xy'[axis]}_rows"] = np.column_stack([np.vstack(terminal.rows), np.concatenate(terminal.bounds)])
        columns[f"{'xy'[axis]}_early"] = np.array(terminal.early)
        if terminal.first:
            counts = [len(bounds) for bounds in terminal.first_bounds]
            bounds = np.concatenate(terminal.first_bounds)
            columns[f"{'xy'[axis]}_first_phase"] = np.repeat(np.arange(terminal.period), counts)
            columns[f"{'xy'[axis]}_first_rows"] = np.column_stack([np.vstack(terminal.first), bounds])
    with replaced_file(path) as staging, staging.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **columns)


def load_terminal_sets(path: Path, wanted_for: Mapping[str, Any]) -> dict[int, TerminalSet]:
    """Reads what `save_terminal_sets` wrote.

    Raises:
        InputError: there is no such file, it is none of these, or it was made for other limits.
    """
    try:
        with np.load(path, allow_pickle=False) as data:
            made_for = json.loads(str(data["made_for"]))
            sets = {axis: _unpacked(axis, data) for axis in (0, 1) if f"{'xy'[axis]}_rows" in data.files}
    except FileNotFoundError:
        raise InputError(f"mpc.terminal_set: file {path} does not exist; `pdhocbf certify` writes one") from None
    except (OSError, ValueError, KeyError, EOFError) as error:
        raise InputError(f"mpc.terminal_set: {path} is not a terminal set: {error}") from None
    wanted = json.loads(json.dumps(wanted_for))
    if different := sorted(key for key in {*made_for, *wanted} if made_for.get(key) != wanted.get(key)):
        key = different[0]
        raise InputError(
            f"mpc.terminal_set: {path} was made for {key} = {made_for.get(key)}, but the scenario has "
            f"{wanted.get(key)}; certify the scenario again"
        )
    return sets


def _unpacked(axis: int, data: Any) -> TerminalSet:
    name = "xy"[axis]
    period = int(data[f"{name}_phase"].max()) + 1
    rows, bounds = _by_phase(data[f"{name}_rows"], data[f"{name}_phase"], period)
    first = f"{name}_first_rows"
    early = _by_phase(data[first], data[f"{name}_first_phase"], period) if first in data.files else ((), ())
    return TerminalSet(axis, rows, bounds, int(data[f"{name}_early"]), *early)


def _by_phase(rows: Any, phases: Any, period: int) -> tuple[tuple[np.ndarray, ...], tuple[np.ndarray, ...]]:
    """Rows and bounds of each phase, the bounds from the last column."""
    of_phase = [rows[phases == phase] for phase in range(period)]
    return tuple(part[:, :-1] for part in of_phase), tuple(part[:, -1] for part in of_phase)
