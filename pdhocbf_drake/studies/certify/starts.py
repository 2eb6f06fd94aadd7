"""Random states inside and outside of certified sets, from which trials start."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.sets.invariant_set import InvariantSet
from pdhocbf_drake.sets.polytope import Array, Polytope, support
from pdhocbf_drake.studies.certify.disturbed import Disturbance
from pdhocbf_drake.studies.shared.stepping_template import SteppingTemplate


class Start(NamedTuple):
    """A phase and a state [c, v, s], or [c, v] where the steps are given [m, m/s, m]."""

    phase: int
    state: Array


def inside_starts(sets: InvariantSet, count: int, random: np.random.Generator, phase: int | None = None) -> list[Start]:
    """States uniform in the sets, at uniform phases, or at the given one."""
    starts: list[Start] = []
    while len(starts) < count:
        at = int(random.integers(len(sets.sets))) if phase is None else phase
        starts.append(Start(at, sets.sets[at].sample(random)))
    return starts


def outside_starts(
    limits: Sequence[Polytope | None],
    sets: InvariantSet,
    count: int,
    random: np.random.Generator,
    margin: float = 1e-4,
) -> list[Start]:
    """States within all limits and outside of the (nonempty) sets by at least a margin [m].

    They are spread over twice the sets' extent, so that many lie close to the boundary of the sets.
    """
    starts: list[Start] = []
    while len(starts) < count:
        phase = int(random.integers(len(sets.sets)))
        part, limit = sets.sets[phase], limits[phase]
        low, high = part.vertices.min(axis=0), part.vertices.max(axis=0)
        state = random.uniform(low - 0.5 * (high - low), high + 0.5 * (high - low))
        if limit is not None and limit.violation(state) <= 0.0 and part.violation(state) > margin:
            starts.append(Start(phase, state))
    return starts


def zmp_range(
    template: SteppingTemplate, sets: InvariantSet, start: Start, disturbance: Disturbance | None = None
) -> tuple[float, float]:
    """The ZMPs from the stance foot that lead from a start into the set of the next tick [m].

    Where the coming step is chosen at this tick, the range is that over all choices. Under a disturbance the start is a
    predicted state, which a disturbance of this tick will have changed.
    """
    k, target = start.phase, sets.sets[(start.phase + 1) % template.period]
    base = template.system.A(k) @ start.state + template.system.c(k)
    B, allowed = template.system.B(k), template.inputs[k]
    left = target.b - target.A @ base
    if disturbance is not None:
        left = left - support(target.A, disturbance.of_prediction(template)[k])
    joint = Polytope.from_rows(np.vstack([allowed.A, target.A @ B]), np.concatenate([allowed.b, left]))
    if joint is None:
        return float("nan"), float("nan")
    centre = 0.0
    if template.weights[k] < 1.0:
        step = start.state[2] if template.chooses_steps else template.held[k]
        centre = -(1.0 - template.weights[k]) * step
    return centre + float(joint.vertices[:, 0].min()), centre + float(joint.vertices[:, 0].max())
