"""The paper to the letter against the paper put right: the effect of each slip where the literal form runs at all."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.loop import walk_template
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.reproduce.lemma_2 import in_words, literal_attempts
from pdhocbf_drake.studies.reproduce.report import Number, Section, Table
from pdhocbf_drake.studies.reproduce.runs import Request, Runs
from pdhocbf_drake.studies.reproduce.walk import ROBOT
from pdhocbf_drake.studies.shared.cases import PERIODIC
from pdhocbf_drake.studies.shared.template import SettledWalk
from pdhocbf_drake.walking.support import contains

_DURATION = 5.0  # [s] of each compared walk of the robot
NO_DOUBLE_SUPPORT: Request = ("walking", f"{{duration: {_DURATION}, gait: {{double_support_ticks: 0}}}}")
MEASURED_ZMP: Request = ("walking", f"{{duration: {_DURATION}, mpc: {{zmp_state: measured}}}}")
HARD: Request = ("paper_vhip", "mpc: {barrier: hard}")
SOFT: Request = ("paper_vhip", "barriers: {forward_speed: {gamma: [0.5, 0.5]}}")
_KICK = 0.02  # [m/s]
_PHASES = range(0, 40, 5)
_AFTER = 40
_ROUNDING = 1e-9  # [m]


def literal_against_corrected(runs: Runs) -> Section:
    """One row for each slip."""
    runs.report("gamma = 1 as a hard constraint after a kick")
    hard, soft = _after_kicks(runs, HARD), _after_kicks(runs, SOFT)
    eta, both = literal_attempts(runs)
    base, jump, measured = (walked(runs.run(r)) for r in (ROBOT[PERIODIC], NO_DOUBLE_SUPPORT, MEASURED_ZMP))
    kick, phases = f"after a kick of {1e3 * _KICK:g} mm/s", len(_PHASES)
    degree = refusal_of("barriers: {forward_speed: {gamma: [1.0], relative_degree: 1}}")
    slips = {
        "η for ω in (28)–(34)": (f"{in_words(eta)} (see Lemma 2)", "ω = √η, periodic where η is"),
        "both (33) and (34)": (
            f"with fixed footholds: {in_words(both)} (see Lemma 2)",
            "one row, discretised to match",
        ),
        f"α₁ = 1, hard, {kick}": (
            f"the QP has no solution at {hard} of {phases} phases",
            f"soft, γ = 0.5: no solution at {soft} of {phases} phases",
        ),
        "no double support (27)": (jump, base),
        "measured ZMP as the MPC's state (Remark 8)": (measured, base),
        "relative degree 1 (25)": (degree, "computed from the dynamics: 2 with the ZMP velocity as input"),
        "H no multiple of the gait": (refusal_of("mpc: {horizon: 60}"), f"H = {runs.walk(SOFT).mpc.config.horizon}"),
    }
    rows = [{"slip": slip, "to the letter": one, "corrected": other} for slip, (one, other) in slips.items()]
    lost = {
        "the letter η": eta.reason != Reason.SOLVED,
        "the two rows at once": both.reason != Reason.SOLVED,
        "γ = 1 made hard": hard > 0,
    }
    return Section(
        "Literal against corrected",
        [
            "Each row takes one statement of the paper to the letter and keeps everything else. Where the letter "
            "can't be run, the library refuses it and gives the reason."
        ],
        tables=[Table("The effect of each slip", rows)],
        numbers=[
            Number(f"hard, gamma 1: phases of {phases} at which the QP has no solution {kick}", None, hard, "phases"),
            Number("the same, soft with gamma 0.5", None, soft, "phases"),
        ],
        finding=finding(lost),
    )


def finding(lost: Mapping[str, bool]) -> str:
    """Names the slips that left the QP without a solution; `lost` holds for each slip whether it did."""
    slips = [slip for slip, without in lost.items() if without]
    return f"Slips that leave the QP without a solution: {', '.join(slips) or 'none'} (of {', '.join(lost)})."


def _after_kicks(runs: Runs, request: Request) -> int:
    """Number of phases at which the program of the scenario has no solution at some tick after the kick."""
    walk, hard = SettledWalk(runs.walk(request)), request == HARD
    kick, count = np.array([[_KICK, 0.0]]), 0
    for phase in _PHASES:
        rows = walk_template(walk.walk.mpc, walk.starts[phase], walk.first + phase, _AFTER, kick)
        count += any(row.plan.fallbacks or (hard and row.plan.slack > 1e-6) for row in rows)
    return count


def walked(run: Run) -> str:
    """Ending, distance, speed, ZMP and least h of the first `_DURATION` seconds of a run of the robot, in words."""
    log, scenario = run.log, run.scenario
    rows = np.asarray((log.time >= scenario.from_time) & (log.time <= _DURATION + 1e-9))
    if not rows.any():
        return f"{log.ending} after {log.time[-1]:.1f} s"
    time, com = log.time[rows], log.element("lip_state", "x")
    zmp, box = log["lip_state"][:, [2, 5]], log["zmp_box"].reshape(-1, 2, 2)
    outside = 1.0 - contains(box, zmp, _ROUNDING)[rows].mean()
    planned = np.stack([log.element("zmp_reference", axis) for axis in ("x_zmp", "y_zmp")], axis=1)
    jump = np.linalg.norm(np.diff(planned, axis=0), axis=1)[rows[1:]].max()
    h = log["h"][rows, 0].min()
    ended = "" if time[-1] > _DURATION - scenario.tick else f"{log.ending} at {log.time[-1]:.1f} s; "
    gone, speed = com[rows][-1] - com[0], (com[rows][-1] - com[rows][0]) / (time[-1] - time[0])
    return (
        f"robot, {time[-1]:g} s: {ended}{gone:.2f} m of {_commanded(scenario, time[-1]):.2f} m commanded, "
        f"{speed:.3f} m/s from {scenario.from_time:g} s on; ZMP outside its box {100 * outside:.0f} % of the time, "
        f"planned ZMP jumps up to {1e3 * jump:.0f} mm a tick, least h {1e3 * h:.0f} mm/s"
    )


def _commanded(scenario: Scenario, time: float) -> float:
    """Distance that the CoM is commanded to have gone [m]: half a stride less than the steps."""
    gait = scenario.gait
    return max(0.0, time / (gait.ticks_per_step * gait.tick) - gait.start_steps - 0.5) * gait.stride


def refusal_of(text: str) -> str:
    """The error message for `paper_vhip` with these overrides, or "accepted"."""
    try:
        build_walk(load_scenario("paper_vhip", text))
    except InputError as error:
        return f"refused: “{error}”"
    return "accepted"
