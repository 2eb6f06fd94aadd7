"""The stepping template: one axis of (22)–(23) in coordinates of the stance foot; ZMP and foothold are its inputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pdhocbf_drake.barriers import AffineBarrier, PeriodicAffineSystem
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.commanded import CommandedSteps
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.robust import zmp_margin
from pdhocbf_drake.mpc.terms.step_limits import step_ranges
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.robot.reach import longest_stride
from pdhocbf_drake.sets.invariant_set import InvariantSet
from pdhocbf_drake.sets.polytope import Array, Polytope
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.walking import Gait, GaitConfig
from pdhocbf_drake.walking.quantities import SPEEDS
from pdhocbf_drake.walking.vhip import Vhip

FASTEST = 5.0
"""Bound on the CoM's speed, which makes the polytopes bounded; no state this fast can be saved [m/s]."""

_TEMPLATE_REACH = 0.23 / 0.58  # of the CoM from the stance foot where a scenario has no robot, over the CoM's height


@dataclass(frozen=True)
class SteppingTemplate:
    """c⁺ = c + δv,  v⁺ = v + δ eta_q (c − p),  p = box centre + d, |d| ≤ half, in coordinates of the stance foot.

    At the end of a step of length s the foot that landed becomes the origin: c⁺ = c + δv − s. During the first D
    ticks of the next step the box still moves from the old foot, at −s, to the new one. A step length is chosen
    `commit` ticks before the foot lands and then stays, as in the controller. So the state is [c, v, s] with s the
    step that was chosen last, and the input [d, σ] with σ the choice, which acts at one tick of a step only. Where
    the range of footholds is a single one, the state is [c, v] and the input [d].

    Attributes:
        axis: 0 (x) or 1 (y). The period is one step along x and two steps along y, where the sides alternate.
        system: the dynamics.
        states: X_q without any barrier: the CoM within its reach of the stance foot, steps within their range.
        inputs: U_q.
        half: half side of the ZMP box, less the planner's margin [m].
        weights: weight of the stance foot in the box centre (the rest is the last foot's), shape (period,).
        steps: shortest and longest step from the step that a phase lies in, shape (period, 2) [m].
        held: the step that s is at a phase, as commanded: the one before, or the coming one, shape (period,) [m].
        coming: phases at which s is the coming step, chosen already, shape (period,).
        eta: shape (period,) [1/s²].
        tick: δ [s].
        ticks_per_step: N.
    """

    axis: int
    system: PeriodicAffineSystem
    states: tuple[Polytope, ...]
    inputs: tuple[Polytope, ...]
    half: float
    weights: Array
    steps: Array
    held: Array
    coming: np.ndarray
    eta: Array
    tick: float
    ticks_per_step: int

    @property
    def period(self) -> int:
        """Ticks after which everything repeats."""
        return self.system.period

    @property
    def chooses_steps(self) -> bool:
        """Whether footholds may differ from the commanded ones."""
        return self.system.n == 3

    def depends_on_step(self, phase: int) -> bool:
        """Whether s matters: the coming step is chosen already, or the box still moves away from the last foot."""
        q = phase % self.period
        return bool(self.chooses_steps and (self.coming[q] or self.weights[q] < 1.0))

    def section(self, sets: InvariantSet, phase: int) -> Polytope | None:
        """A set in (c, v) at a phase, for the commanded s and any ψ_1 that its states may have; None if it is empty."""
        if not sets.enforceable:
            return None
        q = phase % self.period
        part = sets.sets[q].slice(self.held[q]) if self.chooses_steps else sets.sets[q]
        return part.shadow(2) if part is not None and part.dimension > 2 else part

    def with_barriers(
        self, barriers: Sequence[AffineBarrier], states: Sequence[Polytope] | None = None
    ) -> tuple[Polytope | None, ...]:
        """X_q, or the given sets of states, cut by h ≥ 0 of each barrier; None at a phase at which no state is left.

        Raises:
            InputError: the normal of a barrier has a part on the ZMP, which is an input here.
        """
        if wrong := [b.name for b in barriers if np.any(b.normals(0, b.normal_period)[:, 2:])]:
            raise InputError(
                f'barrier "{wrong[0]}": the ZMP is an input of the template, so that a bound on it is an input limit, '
                "and one on ZMP and CoM together is neither that nor a barrier"
            )
        limited = []
        for phase, part in enumerate(self.states if states is None else states):
            rows = np.zeros((len(barriers), self.system.n))
            for row, barrier in zip(rows, barriers, strict=True):
                row[:2] = barrier.sign * barrier.normals(phase, 1)[0, :2]
            bounds = [barrier.sign * barrier.bound(phase) for barrier in barriers]
            limited.append(Polytope.from_rows(np.vstack([part.A, rows]), np.concatenate([part.b, bounds])))
        return tuple(limited)

    def with_input_limit(self, limit: AffineBarrier) -> SteppingTemplate | None:
        """The same template whose ZMP p, seen from the stance foot, also keeps h ≥ 0 of a barrier on the ZMP alone.

        h is a limit on d = p + (1 − w) s. Where the box still moves away from the last foot, at −s, and s is chosen,
        d keeps it for every s in its range, so that the sets are inner ones; None where no d does.
        """
        inputs = list(self.inputs)
        for k in range(self.period):
            steps = self.states[k].vertices[:, 2] if self.chooses_steps else self.held[k : k + 1]
            on_zmp = limit.sign * float(limit.normals(k, 1)[0, 2])
            bound = limit.sign * limit.bound(k) + (on_zmp * (1.0 - self.weights[k]) * steps).min()
            rows = np.vstack([inputs[k].A, on_zmp * np.eye(1, self.system.m)])
            left = Polytope.from_rows(rows, np.append(inputs[k].b, bound))
            if left is None:
                return None
            inputs[k] = left
        return replace(self, inputs=tuple(inputs))

    def state(self, phase: int, com: float, velocity: float, step: float | None = None) -> Array:
        """The template's state, with the commanded step where none is given."""
        held = self.held[phase % self.period] if step is None else step
        return np.array([com, velocity, held])[: self.system.n]


def stepping_template(
    gait_config: GaitConfig, mpc: MpcConfig, axis: int, reach: float, rise: float = 0.0
) -> SteppingTemplate:
    """One axis of a walk's template.

    Args:
        gait_config: the walk, whose start and end play no part.
        mpc: the range of footholds, the ZMP margin, and the ticks for which a foothold is frozen.
        axis: 0 (x) or 1 (y).
        reach: how far the CoM may be from the stance foot along this axis [m].
        rise: of the ground in each step [m].

    Raises:
        InputError: a reach that the commanded step exceeds, or an empty range of footholds.
    """
    gait = Gait(gait_config.model_copy(update={"walk_steps": None}))
    vhip = Vhip(gait.eta(rise), gait_config.tick)
    n, delta = gait.period, gait_config.tick
    parities = SPEEDS[axis].steps
    period, commit = parities * n, min(mpc.freeze_ticks, n - 1 - gait_config.double_support_ticks)
    commanded = CommandedSteps(gait, mpc.horizon, zmp_margin(vhip, mpc))
    # Even steps come first, so that a phase here is a tick modulo the period.
    first = gait_config.start_steps + gait_config.start_steps % 2
    ahead = [commanded.steps(first + parity) for parity in range(parities)]
    ranges = np.array([[limit[axis, 0] for limit in step_ranges(mpc, s)] for s in ahead])
    moves = np.array([s.moves[axis, 0] for s in ahead])
    if np.abs(moves).max() / 2 >= reach:
        raise InputError(f"the CoM's reach of {reach:g} m does not cover a step of {np.abs(moves).max():g} m")
    if np.any(ranges[:, 0] > ranges[:, 1]):
        raise InputError(f"no foothold is allowed along {'xy'[axis]}: a step would be at least {ranges.max():g} m")
    half = float(ahead[0].half[axis, 1])
    if half <= 0:
        raise InputError(f"mpc.zmp_margin leaves nothing of the ZMP box along {'xy'[axis]}")
    free = bool(np.all(ranges[:, 1] - ranges[:, 0] > 1e-6))

    A, B, c = np.zeros((period, 3, 3)), np.zeros((period, 3, 2)), np.zeros((period, 3))
    held, coming = np.empty(period), np.zeros(period, dtype=bool)
    states, inputs, weights = [], [], np.tile(gait.region.weight, parities)
    for phase in range(period):
        parity, q = divmod(phase, n)
        eta = vhip.eta[q]
        coming[phase] = q >= n - commit
        step = parity if coming[phase] else (parity - 1) % parities  # whose length s is
        held[phase] = moves[step]
        # p = −(1 − w) s + d
        A[phase] = [[1.0, delta, 0.0], [eta * delta, 1.0, eta * delta * (1.0 - weights[phase])], [0.0, 0.0, 1.0]]
        B[phase, 1, 0] = -eta * delta
        if q == n - 1 - commit:
            A[phase, 2, 2], B[phase, 2, 1] = 0.0, 1.0
        if q == n - 1:  # the foot that lands becomes the origin
            A[phase, 0] -= A[phase, 2]
            B[phase, 0] -= B[phase, 2]
        low, high = ranges[step]
        if free:
            states.append(Polytope.box([-reach, -FASTEST, low], [reach, FASTEST, high]))
            inputs.append(Polytope.box([-half, ranges[parity, 0]], [half, ranges[parity, 1]]))
        else:
            states.append(Polytope.box([-reach, -FASTEST], [reach, FASTEST]))
            inputs.append(Polytope.box([-half], [half]))
            c[phase, :2] = A[phase, :2, 2] * held[phase]
            if q == n - 1 and commit == 0:
                c[phase, 0] = -moves[parity]
    system = PeriodicAffineSystem(A, B) if free else PeriodicAffineSystem(A[:, :2, :2], B[:, :2, :1], c[:, :2])
    return SteppingTemplate(
        axis, system, tuple(states), tuple(inputs), half, weights, np.repeat(ranges, n, axis=0), held, coming,
        np.tile(vhip.eta, parities), delta, n,
    )  # fmt: skip


def com_reach(scenario: Scenario) -> float:
    """How far the CoM may be from the stance foot: half the robot's longest stride [m]."""
    if scenario.system != "biped":
        return _TEMPLATE_REACH * scenario.gait.com_height
    gait = scenario.gait
    height = gait.com_height + gait.com_height_amplitude
    return longest_stride(Biped.load(scenario.robot), gait.stance_width, height) / 2.0


def area(part: Polytope | None) -> float:
    """The area of a section, 0 for an empty one [m²/s]."""
    return 0.0 if part is None else part.volume()


def is_input_limit(barrier: AffineBarrier) -> bool:
    """Whether a barrier is one on the ZMP alone, which is an input of the template."""
    normals = barrier.normals(0, barrier.normal_period)
    return bool(not np.any(normals[:, :2]))
