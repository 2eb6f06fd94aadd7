"""The template, turning sharply: what repeats in the stance frame."""

from __future__ import annotations

from typing import Final

import numpy as np

from pdhocbf_drake.analysis.heading import along, zmp_seen
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.studies.shared.checks import Outcome, most
from pdhocbf_drake.studies.shared.row_kinds import Asked
from pdhocbf_drake.studies.shared.work import Work

ROW: Final = "template"
_SCENARIO = "vhip_nobarrier"
_TURN = 0.3  # of a step [rad]
_STEPS = 60  # until it has settled to rounding
_EXACT = 1e-9  # [m, m/s]


def plan(row: str, asked: Asked) -> list[Work]:
    """One walk of the template alone."""
    return [Work(row, load_scenario(_SCENARIO, "").model_dump_json(), {})]


def measure(work: Work) -> Outcome:
    """Walks and turns, and compares the last gait with the one before."""
    scenario = work.with_keys()
    gait = scenario.gait
    step = gait.ticks_per_step * gait.tick
    command = {"time": 0.0, "velocity": [gait.stride / step, 0.0], "turn": _TURN / step}
    log = simulate(work.with_keys(duration=_STEPS * step, commands=[command]))
    later = log.after((_STEPS - 4) * step)
    box = later["zmp_box"].reshape(-1, 2, 2)
    zmp = zmp_seen(later)[1:]  # the box's frame is that of the tick before
    beyond = np.maximum(box[1:, :, 0] - zmp, zmp - box[1:, :, 1]).max()
    solved = log.element("solver_status", "reason")[1:] == Reason.SOLVED
    seen, world = seen_from_stance(later), later["lip_state"]
    return Outcome(
        [
            most(ROW, "recurrence after two steps", change(seen, gait.ticks_per_gait), _EXACT, "m, m/s"),
            most(ROW, "ZMP beyond its box", max(0.0, float(beyond)), _EXACT, "m"),
            most(ROW, "ticks without a plan", float((~solved).sum()), 0.0),
        ],
        [
            f"template, turning by {_TURN:g} rad a step: the speed along the heading changes by up to "
            f"{1e3 * change(seen[:, 2], gait.ticks_per_step):.0f} mm/s from a step to the next one, and the velocity "
            f"in the world by up to {1e3 * change(world[:, [1, 4]], gait.ticks_per_gait):.0f} mm/s in two steps"
        ],
    )


def seen_from_stance(log: RunLog) -> np.ndarray:
    """CoM, CoM velocity and ZMP as the stance foot sees them, x and y of each, (T, 6) [m, m/s].

    Row k has the state of tick k and the plan for it: the stance and its heading are those of the step of tick k.
    """
    yaw, foot = log.element("path", "yaw"), log["stance_plan"][:, 2:4]
    x, vx, x_zmp, y, vy, y_zmp = log["lip_state"].T
    columns = [np.column_stack([x, y]) - foot, np.column_stack([vx, vy]), np.column_stack([x_zmp, y_zmp]) - foot]
    return np.concatenate([along(column, yaw) for column in columns], axis=1)


def change(values: np.ndarray, ticks: int) -> float:
    """The largest difference of a row from the one so many ticks later, in the values' unit."""
    return float(np.abs(values[ticks:] - values[:-ticks]).max())
