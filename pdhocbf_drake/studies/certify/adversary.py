"""Disturbances within a box that a walk's certificate is tried with: random ones, constant ones, and the worst ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np

from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.plan import Plan
from pdhocbf_drake.sets.invariant_set import InvariantSet
from pdhocbf_drake.sets.polytope import Array
from pdhocbf_drake.studies.certify.disturbed import Disturbance
from pdhocbf_drake.studies.shared.stepping_template import SteppingTemplate

Kind = Literal["random", "constant", "worst"]
KINDS: tuple[Kind, ...] = ("random", "constant", "worst")
Adversary = Callable[[int, np.ndarray, Memory, Plan], np.ndarray]
"""What is added to [c, v](k) of x and y: see `walk_template`."""


def adversary(
    kind: Kind,
    disturbances: Sequence[Disturbance],
    templates: Sequence[SteppingTemplate],
    sets: Sequence[InvariantSet],
    random: np.random.Generator,
) -> Adversary:
    """Disturbances of one kind.

    Args:
        kind: "random" takes one corner of the box or another at each tick, "constant" the same for ever, and "worst"
            the one after which the state predicted next is deepest outside of the sets, or closest to their edge.
        disturbances, templates, sets: of x and y, the sets as those of `walk_sets`.
    """
    fixed = random.choice([-1.0, 1.0], size=(2, 2))

    def largest(tick: int) -> np.ndarray:
        """Half-widths of x and y of what is added to the state at a tick."""
        return np.array([part.points(tick - 1, 2).max(axis=0) for part in disturbances])

    if kind == "constant":
        return lambda tick, state, memory, plan: fixed * largest(tick)
    if kind == "random":
        return lambda tick, state, memory, plan: random.choice([-1.0, 1.0], size=(2, 2)) * largest(tick)
    return lambda tick, state, memory, plan: np.array(
        [
            _worst(part.points(tick - 1, 2), template, inner, tick, *_seen(template, axis, tick, state, memory, plan))
            for axis, (part, template, inner) in enumerate(zip(disturbances, templates, sets, strict=True))
        ]
    )


def _seen(
    template: SteppingTemplate, axis: int, tick: int, state: Array, memory: Memory, plan: Plan
) -> tuple[Array, Array]:
    """State and input of the template at a tick, from those of the walk."""
    foot, last = memory.stance[axis, 1], memory.stance[axis, 1] - memory.stance[axis, 0]
    k, planned = tick % template.period, float(plan.footholds[axis, 0] - foot)
    step = planned if template.coming[k] else last
    seen = np.array([state[axis, 0] - foot, state[axis, 1], step])
    zmp = state[axis, 2] - foot + (1.0 - template.weights[k]) * last
    return seen[: template.system.n], np.array([zmp, planned])[: template.system.m]


def _worst(corners: Array, template: SteppingTemplate, sets: InvariantSet, tick: int, state: Array, u: Array) -> Array:
    k = tick % template.period
    target = sets.sets[(k + 1) % template.period]
    after = template.system.step(k, state, u) + corners @ template.system.A(k)[:, :2].T
    return np.asarray(corners[target.violation(after).argmax()])
