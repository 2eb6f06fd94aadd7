"""The whole-body program on the ticks of a walk: its time beside the MPC's, and its optima beside Clarabel's."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.systems.analysis import Simulator

from pdhocbf_drake.robot import ROLES
from pdhocbf_drake.simulation.simulate import make_diagram
from pdhocbf_drake.studies.limits.rows import PROGRAM
from pdhocbf_drake.studies.limits.weak import Peaks, write_weak
from pdhocbf_drake.studies.shared.checks import Outcome, least, most
from pdhocbf_drake.studies.shared.row_kinds import Asked
from pdhocbf_drake.studies.shared.work import Work
from pdhocbf_drake.systems.unbundled import leaf_of
from pdhocbf_drake.whole_body.layer import WholeBody
from pdhocbf_drake.whole_body.solver import Program, solve_with_clarabel, solve_with_daqp

_TICKS = 1000
_SHARE = 0.8  # of the peak torque that the joint of the walk has
_FIRST = 10  # calls, in which code is loaded, are not timed
_WEAK = "hip_roll"  # a joint that is at its limit for a large part of each step


class Recording:
    """Stands for a `WholeBody`: keeps its programs, and the seconds of each call."""

    def __init__(self, keep: WholeBody) -> None:
        self._keep, self.seconds, self.programs = keep, list[float](), list[Program]()
        solve: Callable[[Program], Any] = keep.solve

        def recorded(program: Program) -> Any:
            self.programs.append(program)
            return solve(program)

        keep.solve = recorded

    def __call__(self, *arguments: Any) -> Any:
        started = time.thread_time()
        kept = self._keep(*arguments)
        self.seconds.append(time.thread_time() - started)
        return kept

    def __getattr__(self, name: str) -> Any:
        return getattr(self._keep, name)


def plan(row: str, asked: Asked) -> list[Work]:
    """One walk; where quick, a fifth of it."""
    return [Work(row, asked.scenario, {"peaks": asked.prepared, "ticks": _TICKS // 5 if asked.quick else _TICKS})]


def measure(work: Work) -> Outcome:
    """A walk in which a program is solved at every tick, and a joint has 0.8 of its peak."""
    scenario, ticks = work.with_keys(), work.setting["ticks"]
    peaks: Peaks = work.setting["peaks"]
    changes = {"duration": ticks * scenario.tick, "whole_body": scenario.whole_body.model_copy(update={"kind": "qp"})}
    weak = _WEAK, _SHARE * peaks.torque[ROLES.index(_WEAK)]
    with tempfile.TemporaryDirectory() as folder:
        walk = write_weak(scenario.model_copy(update=changes), weak, None, Path(folder) / "robot.yaml")
        logged = make_diagram(walk, form="blocks")
        layer = leaf_of(logged.diagram.GetSubsystemByName("inverse_kinematics")).layer
        layer.keep = recording = Recording(layer.keep)
        simulator = Simulator(logged.diagram)
        simulator.AdvanceTo(walk.duration)
        log = logged.recorded(simulator.get_context())
    answers = [(solve_with_daqp(program), solve_with_clarabel(program)) for program in recording.programs]
    apart = [np.inf if (a is None) != (b is None) else 0.0 if a is None else np.abs(a - b).max() for a, b in answers]
    mpc, own = np.median(log["solver_status"][1:, 1]), np.array(recording.seconds[_FIRST:])
    return Outcome(
        [
            least(PROGRAM, "programs", float(len(answers)), float(ticks)),
            most(PROGRAM, "apart from Clarabel", max(apart), 1e-7),
            most(PROGRAM, "median time over the MPC's", float(np.median(own) / mpc), 2.0),
            most(PROGRAM, "99th percentile over the MPC's median", float(np.percentile(own, 99) / mpc), 4.0),
        ]
    )
