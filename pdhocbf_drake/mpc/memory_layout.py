"""How what the controller remembers lies in one vector, as a block's discrete state needs it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pdhocbf_drake.mpc.axis_problem import layout
from pdhocbf_drake.mpc.believed import Beliefs
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.memory import UNCOMMANDED, Memory
from pdhocbf_drake.mpc.plan import Plan, Reason
from pdhocbf_drake.mpc.recovery import Disturbance
from pdhocbf_drake.walking.course import NO_COURSE, Course
from pdhocbf_drake.walking.footsteps import Resumed

OUTPUTS = (
    "com_reference", "zmp_reference", "zmp_box", "stance_plan", "foot_plan", "solver_status", "barrier_slack",
    "barrier_active", "unmet",
)  # fmt: skip
"""The parts that other blocks or the log read, and that the next tick does not need."""

_NONE, _NUMBER = np.zeros(0), np.dtype(float)
_NUMBERS = 16  # single numbers, from `input_disturbance` to `plan`, with which the part behind the outputs begins


class MemoryLayout:
    """Where each part of a `Memory` lies in one vector, as a block's discrete state needs it.

    Attributes:
        sizes: every part in its order, the outputs first.
        places: where each part lies.
        carried: the parts behind the outputs, which the next tick needs.
        size: length of the vector.
    """

    def __init__(self, mpc: PeriodicMpc) -> None:
        rows, barriers = mpc.rows, sum(map(len, mpc.barriers))
        commands = (len(NO_COURSE), len(UNCOMMANDED)) if mpc.gait.turns else (0, 0)
        self.sizes = {
            "com_reference": 6, "zmp_reference": 4, "zmp_box": 4, "stance_plan": 8, "foot_plan": 8, "solver_status": 6,
            "barrier_slack": barriers, "barrier_active": barriers, "unmet": 2 * len(mpc.constraints),
            "input_disturbance": 4, "last_step": 1, "resumed": 3, "course": commands[0], "command": commands[1],
            "degraded": 1, "disturbance": 4, "plan": 3, "measured": 4, "state": 6, "feet": 4, "stance": 4,
            "zmp_shift": 2, "evidence": 2, "sent": 2 * mpc.config.delay_ticks,
            "acted": 2 * mpc.config.delay_ticks + 2,
            "inputs": 2 * mpc.config.horizon, "footholds": 2 * mpc.footholds, "active_x": rows[0],
            "active_y": rows[1],
        }  # fmt: skip
        self.places = layout(self.sizes)
        self.size = sum(self.sizes.values())
        self.carried = slice(self.places["input_disturbance"].start, self.size)
        start = self.carried.start
        behind = [slice(p.start - start, p.stop - start) for p in self.places.values() if p.start >= start]
        self._follows, self._numbers = mpc.gait.turns, _NUMBERS + sum(commands)
        self._arrays = [place for place in behind if place.start >= self._numbers]
        self._planned = self.size - self.places["inputs"].start

    def pack(self, memory: Memory) -> np.ndarray:
        """The whole memory as one vector; the plan's parts are zero where there is none."""
        return joined(self.parts(memory))

    def parts(self, memory: Memory) -> list[np.ndarray]:
        """What `pack` puts behind each other."""
        plan, disturbance, beliefs = memory.plan, memory.disturbance, memory.beliefs
        marks = (-1.0, 0.0, 0.0) if plan is None else (plan.tick, plan.fallbacks, plan.recovering)
        numbers = np.array(
            [
                *beliefs.input_disturbance.tolist(), memory.last_step, *memory.resumed, *self._commands(memory),
                memory.degraded, *disturbance.error_sum, disturbance.active, disturbance.quiet, *marks,
            ]
        )  # fmt: skip
        planned = [np.zeros(self._planned)] if plan is None else [plan.inputs, plan.footholds, *plan.active]
        return [
            memory.com_reference, memory.zmp_reference, memory.zmp_box, memory.stance_plan, memory.foot_plan,
            memory.solver_status, memory.barrier_slack, memory.barrier_active, memory.unmet, numbers, memory.measured,
            memory.state, memory.feet, memory.stance, *beliefs[1:], *planned,
        ]  # fmt: skip

    def _commands(self, memory: Memory) -> list[float]:
        """The numbers of course and command, where the walk follows commands."""
        if not self._follows:
            return []
        return [*(NO_COURSE if memory.course is None else memory.course.numbers), *memory.command]

    def unpack(self, vector: np.ndarray) -> Memory:
        """The inverse of `pack`, as copies."""
        memory = self.unpack_carried(vector[self.carried])
        for name in OUTPUTS:
            setattr(memory, name, np.array(vector[self.places[name]]))
        return memory

    def unpack_carried(self, carried: np.ndarray) -> Memory:
        """A memory from the part `carried` of the vector, as copies; its outputs are empty until the next tick."""
        own = np.array(carried)
        last_step, first, side, last, *commands = own[4 : self._numbers].tolist()
        degraded, x, y, disturbed, quiet, tick, fallbacks, recovering = commands[-8:]
        measured, state, feet, stance, *arrays = [own[place] for place in self._arrays]
        zmp_shift, evidence, sent, acted, inputs, footholds, active_x, active_y = arrays
        plan = None
        if tick >= 0:
            plan = Plan(
                round(tick), inputs.reshape(2, -1), footholds.reshape(2, -1), (active_x, active_y), _NONE, math.nan,
                Reason.SOLVED, round(fallbacks), bool(recovering),
            )  # fmt: skip
        return Memory(
            _NONE, _NONE, _NONE, _NONE, _NONE, _NONE, _NONE, _NONE, _NONE,
            state.reshape(2, 3), feet.reshape(2, 2), stance.reshape(2, 2), last_step, degraded, measured, plan,
            Disturbance((x, y), bool(disturbed), round(quiet)), Resumed(round(first), round(side), round(last)),
            Course.of(commands[:-12]) if self._follows else None,
            tuple(commands[-12:-8]) if self._follows else UNCOMMANDED,
            Beliefs(own[:4], zmp_shift, evidence, sent.reshape(2, -1), acted.reshape(2, -1)),
        )  # fmt: skip


def joined(parts: Sequence[np.ndarray]) -> np.ndarray:
    """All numbers of the arrays one behind the other, as `np.concatenate` with no axis, in half of its time."""
    if [part for part in parts if part.dtype is not _NUMBER]:
        return np.concatenate(parts, axis=None)
    try:
        return np.frombuffer(bytearray().join(parts))  # type: ignore[arg-type]  # arrays are buffers
    except (TypeError, ValueError, BufferError):  # the numbers of one of them do not lie one behind the other
        return np.concatenate(parts, axis=None)
