"""The largest push at each phase of the step that some controller can still answer within the limits."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog

from pdhocbf_drake.sets.invariant_set import InvariantSet
from pdhocbf_drake.sets.polytope import Array
from pdhocbf_drake.studies.shared.stepping_template import SteppingTemplate


class PushRange(NamedTuple):
    """Admissible changes between the most negative and the most positive one; NaN where the state is outside.

    Attributes:
        low, high: velocity change [m/s]; times the mass it is the impulse [N s].
    """

    low: float
    high: float


def kick_range(template: SteppingTemplate, sets: InvariantSet, phase: int, state: Array) -> PushRange:
    """Sudden changes of velocity at [c, v] that stay within the set."""
    part = template.section(sets, phase)
    if part is None:
        return PushRange(np.nan, np.nan)
    slack, along = part.b - part.A @ state[:2], part.A[:, 1]
    if slack.min() < 0:
        return PushRange(np.nan, np.nan)
    high = np.min(slack[along > 0] / along[along > 0], initial=np.inf)
    low = np.max(slack[along < 0] / along[along < 0], initial=-np.inf)
    return PushRange(float(low), float(high))


def push_range(template: SteppingTemplate, sets: InvariantSet, phase: int, state: Array, ticks: int) -> PushRange:
    """Total velocity changes by a constant force over some ticks, from [c, v] on, under the best response.

    The response may depend on the whole push and moves ZMP and foothold from its first tick on; the state must be in
    the set at every tick. So no controller does better, and one that must first measure the push does worse.
    """
    if not sets.enforceable:
        return PushRange(np.nan, np.nan)
    n, m = template.system.n, template.system.m
    first = template.state(phase, *state[:2])
    size = ticks * m + 1  # the inputs, then the change of velocity a tick
    row_blocks, bound_blocks = [], []
    on, rest = np.zeros((n, size)), first
    for i in range(ticks):
        k = phase + i
        at = slice(i * m, (i + 1) * m)
        allowed = template.inputs[k % template.period]
        block = np.zeros((len(allowed.A), size))
        block[:, at] = allowed.A
        row_blocks.append(block)
        bound_blocks.append(allowed.b)
        A = template.system.A(k)
        on, rest = A @ on, A @ rest + template.system.c(k)
        on[:, at] += template.system.B(k)
        on[1, -1] += 1.0
        target = sets.sets[(k + 1) % template.period]
        row_blocks.append(target.A @ on)
        bound_blocks.append(target.b - target.A @ rest)
    rows, bounds = np.vstack(row_blocks), np.concatenate(bound_blocks)
    cost = np.eye(1, size, size - 1)[0]
    programs = [linprog(way * cost, A_ub=rows, b_ub=bounds, bounds=(None, None), method="highs") for way in (1, -1)]
    return PushRange(*(ticks * float(found.x[-1]) if found.success else np.nan for found in programs))
