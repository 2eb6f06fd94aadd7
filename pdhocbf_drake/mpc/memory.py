"""What the controller carries from tick to tick, and its layout as one vector."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from pdhocbf_drake.jit import compiled
from pdhocbf_drake.mpc.axis_program import layout
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.plan import Plan
from pdhocbf_drake.mpc.recovery import CALM, Disturbance, divergent_error
from pdhocbf_drake.mpc.solution import Reason
from pdhocbf_drake.walking.footsteps import BOTH, LEFT

OUTPUTS = (
    "com_reference", "zmp_reference", "zmp_box", "stance_plan", "foot_plan", "solver_status", "barrier_slack", "unmet",
)  # fmt: skip
"""The parts that are shown to other blocks, or logged, and not needed again."""

_FEET = {LEFT: 0, -LEFT: 1}
_NONE = np.zeros(0)
_CARRIED: WeakKeyDictionary[PeriodicMpc, list[slice]] = WeakKeyDictionary()
_LAYOUTS: WeakKeyDictionary[PeriodicMpc, dict[str, slice]] = WeakKeyDictionary()


@dataclass
class Memory:
    """The controller's state after the update at tick k: outputs for tick k + 1, then what the next solve needs.

    Attributes:
        com_reference: x, ẋ, ẍ, y, ẏ, ÿ planned for k + 1 [m, m/s, m/s²].
        zmp_reference: x_zmp planned for k + 1 and its velocity up to then, likewise y [m, m/s].
        zmp_box: the box (27) at k + 1: x_min, x_max, y_min, y_max [m].
        stance_plan: box centres of the last, this and the next two steps, as seen from k + 1 [m].
        foot_plan: where the left foot starts and ends this step, then the right one: x, y each [m].
        solver_status: solved, wall time [s], cost, slack [m/s], fallbacks in a row, reason.
        barrier_slack: each barrier's largest slack, in the order of the controller's barriers, shape (n_b,) [m/s].
        unmet: as `Plan.unmet`, x then y, shape (6,) [m].
        state: predicted [c, v, p] at k + 1 per axis, shape (2, 3).
        feet: last contact positions of the left and right foot, shape (2, 2) [m].
        stance: box centres of the last and this step per axis, shape (2, 2) [m].
        last_step: the step with the last swing, once the walk is to come to a stand; else −1.
        degraded: ticks in a row that had no solution or no measurement.
        measured: c and v of both axes as measured at k [m, m/s].
        plan: the plan made at k, or None at the start.
    """

    com_reference: np.ndarray
    zmp_reference: np.ndarray
    zmp_box: np.ndarray
    stance_plan: np.ndarray
    foot_plan: np.ndarray
    solver_status: np.ndarray
    barrier_slack: np.ndarray
    unmet: np.ndarray
    state: np.ndarray
    feet: np.ndarray
    stance: np.ndarray
    last_step: float
    degraded: float
    measured: np.ndarray
    plan: Plan | None
    disturbance: Disturbance = CALM

    @staticmethod
    def sizes(mpc: PeriodicMpc) -> dict[str, int]:
        """Every part in its order: the outputs, then what is carried on to the next tick."""
        rows = mpc.rows
        return {
            "com_reference": 6, "zmp_reference": 4, "zmp_box": 4, "stance_plan": 8, "foot_plan": 8, "solver_status": 6,
            "barrier_slack": sum(map(len, mpc.barriers)), "unmet": 6,
            "last_step": 1, "degraded": 1, "disturbance": 4, "plan": 3, "measured": 4, "state": 6, "feet": 4,
            "stance": 4, "inputs": 2 * mpc.config.horizon, "footholds": 2 * mpc.footholds, "active_x": rows[0],
            "active_y": rows[1],
        }  # fmt: skip

    @staticmethod
    def layout(mpc: PeriodicMpc) -> dict[str, slice]:
        """Where each part lies in the packed vector; worked out once for each `mpc`."""
        places = _LAYOUTS.get(mpc)
        if places is None:
            places = _LAYOUTS[mpc] = layout(Memory.sizes(mpc))
        return places

    @classmethod
    def at_start(cls, mpc: PeriodicMpc, state: np.ndarray, feet: np.ndarray) -> Memory:
        """Standing (or walking) at tick 0 in `state`, both feet where they are given."""
        gait = mpc.gait
        centre = _centre(gait.support(0), feet)
        stance = np.stack([centre, centre], axis=1)
        eta = mpc.vhip.eta[0]
        com = np.array([[c, v, eta * (c - p)] for c, v, p in state]).ravel()
        zmp = np.array([[p, 0.0] for p in state[:, 2]]).ravel()
        memory = cls(
            com, zmp, np.zeros(4), np.zeros(8), np.zeros(8), np.array([1.0, 0, 0, 0, 0, Reason.SOLVED]),
            np.zeros(sum(map(len, mpc.barriers))), np.zeros(6), np.array(state, dtype=float),
            np.array(feet, dtype=float), stance, -1.0, 0.0, np.full(4, np.nan), None,
        )  # fmt: skip
        memory._show(mpc, 0, stance[:, 1:] + np.cumsum(mpc.preview.steps(0).moves, axis=1))
        return memory

    def land(self, mpc: PeriodicMpc, tick: int, measured: np.ndarray) -> None:
        """At the first tick of a step, takes the foot that came down to be where it is measured (if it is)."""
        step, phase = mpc.gait.phase(tick)
        before = mpc.gait.support(step - 1)
        if phase or step == 0 or before == BOTH or not np.all(np.isfinite(measured)):
            return
        landed = _FEET[-before]
        self.feet[landed] = measured[landed]
        self.stance[:, 1] = _centre(mpc.gait.support(step), self.feet)

    def notice(self, mpc: PeriodicMpc, tick: int, state: np.ndarray) -> None:
        """Compares the state believed at tick k with what was predicted of it."""
        config = mpc.config.recovery
        if config is None:
            return
        moved = 0.0
        if self.plan is not None:
            step = tick // mpc.gait.period
            coming = step - self.plan.tick // mpc.gait.period  # the plan's first foothold is taken at a new step
            (_, x), (_, y) = self.stance.tolist()
            along, aside = mpc.preview.steps(step).moves[:, 0].tolist()
            foot_x, foot_y = self.plan.footholds[:, coming].tolist()
            moved = max(abs(foot_x - x - along), abs(foot_y - y - aside))
        error = divergent_error(mpc.divergent, tick, state, self.state)
        self.disturbance = self.disturbance.after(config, mpc.gait.period, error, moved)

    def advance(self, mpc: PeriodicMpc, state: np.ndarray, plan: Plan) -> None:
        """Steps the template by the plan's first input and moves on to tick k + 1."""
        gait, tick = mpc.gait, plan.tick
        self.plan = plan
        here, following = tick % mpc.vhip.period, (tick + 1) % mpc.vhip.period
        self.state, self.com_reference, self.zmp_reference = np.empty((2, 3)), np.empty(6), np.empty(4)
        _move_on(
            mpc.vhip.A[here], mpc.vhip.B[here], mpc.vhip.eta[following], state, plan.inputs,
            self.state, self.com_reference, self.zmp_reference,
        )  # fmt: skip
        footholds = plan.footholds
        boxes = mpc.recovery if plan.recovering and mpc.recovery is not None else mpc
        self.zmp_box = boxes.zmp_box(tick + 1, self.stance, footholds).ravel()
        step, phase = gait.phase(tick + 1)
        if phase == 0:
            support = gait.support(step - 1)
            if support != BOTH:
                self.feet[_FEET[-support]] = _landing(gait.support(step), self.stance[:, 1], footholds[:, 0])
            centre = _centre(gait.support(step), self.feet)
            self.stance = np.stack([self.stance[:, 1], centre], axis=1)
            moves = mpc.preview.steps(step).moves
            footholds = np.hstack([footholds[:, 1:], footholds[:, -1:] + moves[:, -1:]])
        self._show(mpc, tick + 1, footholds)

    def _show(self, mpc: PeriodicMpc, tick: int, footholds: np.ndarray) -> None:
        """Fills the outputs that tell where feet are and go."""
        step, _ = mpc.gait.phase(tick)
        self.stance_plan = np.concatenate([self.stance.T, footholds[:, :2].T]).ravel()
        ends = self.feet.copy()
        support = mpc.gait.support(step)
        if support != BOTH:
            ends[_FEET[-support]] = _landing(mpc.gait.support(step + 1), self.stance[:, 1], footholds[:, 0])
        self.foot_plan = np.concatenate([self.feet, ends], axis=1).ravel()
        if tick == 0:
            self.zmp_box = mpc.zmp_box(1, self.stance, footholds).ravel()

    def pack(self, mpc: PeriodicMpc) -> np.ndarray:
        """The whole memory as one vector; the plan's parts are zero where there is none."""
        vector = np.zeros(self.layout(mpc)["active_y"].stop)
        plan, disturbance = self.plan, self.disturbance
        marks = (-1.0, 0.0, 0.0) if plan is None else (plan.tick, plan.fallbacks, plan.recovering)
        numbers = (self.last_step, self.degraded, *disturbance.astray, disturbance.active, disturbance.quiet, *marks)
        parts: list[Any] = [self.com_reference, self.zmp_reference, self.zmp_box, self.stance_plan, self.foot_plan,
                            self.solver_status, self.barrier_slack, self.unmet, numbers, self.measured,
                            self.state.ravel(), self.feet.ravel(), self.stance.ravel()]  # fmt: skip
        if plan is not None:
            parts += [plan.inputs.ravel(), plan.footholds.ravel(), *plan.active]
        known = np.concatenate(parts)
        vector[: len(known)] = known
        return vector

    @classmethod
    def unpack(cls, mpc: PeriodicMpc, vector: np.ndarray) -> Memory:
        """The inverse of `pack`, as copies."""
        places = cls.layout(mpc)
        memory = cls.carried(mpc, vector[places["last_step"].start :])
        for name in OUTPUTS:
            setattr(memory, name, np.array(vector[places[name]]))
        return memory

    @classmethod
    def carried(cls, mpc: PeriodicMpc, vector: np.ndarray) -> Memory:
        """From the packed vector's part behind the outputs, as copies; the outputs are left to `advance`."""
        own = np.array(vector)
        parts = [own[place] for place in _carried_places(mpc)]
        last_step, degraded, disturbance, marks, measured, state, feet, stance, inputs, footholds, *active = parts
        x, y, disturbed, quiet = disturbance.tolist()
        tick, fallbacks, recovering = marks.tolist()
        plan = None
        if tick >= 0:
            plan = Plan(
                round(tick), inputs.reshape(2, -1), footholds.reshape(2, -1), (active[0], active[1]), _NONE, math.nan,
                Reason.SOLVED, round(fallbacks), bool(recovering),
            )  # fmt: skip
        return cls(
            _NONE, _NONE, _NONE, _NONE, _NONE, _NONE, _NONE, _NONE,
            state.reshape(2, 3), feet.reshape(2, 2), stance.reshape(2, 2), float(last_step[0]), float(degraded[0]),
            measured, plan,
            Disturbance((x, y), bool(disturbed), round(quiet)),
        )  # fmt: skip


def _carried_places(mpc: PeriodicMpc) -> list[slice]:
    """Where the parts behind the outputs lie, counted from the first of them; worked out once for each `mpc`."""
    places = _CARRIED.get(mpc)
    if places is None:
        behind = list(Memory.sizes(mpc).values())[len(OUTPUTS) :]
        stops = np.cumsum(behind).tolist()
        places = _CARRIED[mpc] = [slice(stop - size, stop) for size, stop in zip(behind, stops, strict=True)]
    return places


@compiled
def _move_on(
    A: np.ndarray, B: np.ndarray, eta: float, state: np.ndarray, inputs: np.ndarray, following: np.ndarray,
    com: np.ndarray, zmp: np.ndarray,
) -> None:  # fmt: skip
    """Writes [c, v, p] of both axes a tick later (23), then `com_reference` and `zmp_reference`."""
    for axis in range(2):
        for i in range(3):
            total = B[i] * inputs[axis, 0]
            for j in range(3):
                total += A[i, j] * state[axis, j]
            following[axis, i] = total
        c, v, p = following[axis, 0], following[axis, 1], following[axis, 2]
        com[3 * axis], com[3 * axis + 1], com[3 * axis + 2] = c, v, eta * (c - p)
        zmp[2 * axis], zmp[2 * axis + 1] = p, inputs[axis, 0]


def _centre(support: int, feet: np.ndarray) -> np.ndarray:
    return feet.mean(axis=0) if support == BOTH else feet[_FEET[support]]


def _landing(following: int, stance: np.ndarray, foothold: np.ndarray) -> np.ndarray:
    """Where the swing foot lands: on the next stance, or, before a stand, so that both feet frame its centre."""
    return 2.0 * foothold - stance if following == BOTH else foothold
