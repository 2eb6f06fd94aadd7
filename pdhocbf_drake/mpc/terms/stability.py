"""The stability condition, eqs. (33) and (34), which say the same."""

from __future__ import annotations

import math
from collections.abc import Hashable
from copy import copy
from functools import lru_cache
from typing import ClassVar

import numpy as np

from pdhocbf_drake.mpc.terms.program import AxisProgram
from pdhocbf_drake.mpc.terms.term import RowKind, Setting, Term, Tick

MISSED_TAIL = 1e8
"""Price of a missed tail, squared, on the relaxed rung [1/s²]: far above all else, so that little is missed."""

_LEFT = 1e-11  # discount, by e^{-ωδi}, at which the anticipative tail is cut: of a metre's step 1e-11 m are left


class Stability(Term):
    """Σ_i g_i u(k+i) / Π_{j≤i} λ_{k+j} + tail = e_k, with e = c + v/ω − p: eqs. (30)–(35), discretised alike.

    The tail is Π λ⁻¹ e_{k+H}: with Π λ⁻¹ e_k it is the periodic one (32), with 0 the truncated one, and with the ZMP
    motion that the gait commands beyond H the anticipative one. A walk that does not repeat over the horizon (a start,
    an end) has the anticipative tail in place of the periodic one.

    The row is demanded, or with `mpc.stability: paid`, with a terminal set, and on the relaxed rung paid for.

    Parameters: tail (1,) [m].
    """

    rows: ClassVar = {"stability": RowKind("tick", missed_as="stability")}
    axes_alike = True

    def __init__(self, setting: Setting) -> None:
        super().__init__(setting)
        config, divergent = setting.config, setting.divergent
        demanded = config.stability == "demanded" and setting.terminal is None
        self.price = None if demanded else config.tail_weight  # of a missed tail, squared [1/s²]
        self._discount = [float(divergent.discounts(q, config.horizon)[-1]) for q in range(setting.gait.period)]
        gaits = math.log(_LEFT) / math.log(float(divergent.discounts(0, divergent.period)[-1]))
        self._seen = max(
            config.horizon, divergent.period * math.ceil(gaits)
        )  # ticks from k on that the tail is made of
        self._anticipative = lru_cache(maxsize=4)(self._anticipative_tails)

    @classmethod
    def of(cls, setting: Setting) -> list[Term]:
        return [] if setting.turn or setting.gait.turns else [cls(setting)]

    @property
    def sizes(self) -> dict[str, int]:
        return {"tail": 1}

    @property
    def key(self) -> Hashable:
        return super().key, self.price

    def row(self, phase: int) -> np.ndarray:
        """Coefficients of u, [c, v, p] and the tail, shape (H + 4,)."""
        weights = self.setting.divergent.input_weights(phase, self.setting.config.horizon)
        return np.concatenate([weights, -self.setting.divergent.offset_row(phase), [1.0]])

    def write(self, program: AxisProgram) -> None:
        row = self.row(program.phase)
        variables = np.concatenate([program.u, program.part["state"], program.part["tail"]])
        if self.price is None:
            program.equal_zero(row[None], variables, "stability")
        else:
            program.price(2.0 * self.price * np.outer(row, row), variables, "stability")

    def fill_tick(self, tick: Tick, theta: np.ndarray) -> None:
        kind = self.setting.config.tail
        if kind == "periodic" and tick.ahead.repeats:
            theta[self.places["tail"].start] = self.periodic_tail(tick)
        elif kind != "truncated":
            theta[self.places["tail"].start] = self.anticipative_tail(tick.tick)

    def periodic_tail(self, tick: Tick) -> float:
        """Π λ⁻¹ e_k [m], eq. (32)."""
        return self._discount[tick.phase] * tick.error[self.axis]

    def anticipative_tail(self, tick: int) -> float:
        """Π λ⁻¹ e_{k+H} for a ZMP that follows the commanded box centre beyond the horizon [m]."""
        step, phase = divmod(tick, self.setting.gait.period)
        return float(self._anticipative(step)[phase])

    def _anticipative_tails(self, step: int) -> np.ndarray:
        """At every tick of a step, shape (N,)."""
        gait, horizon = self.setting.gait, self.setting.config.horizon
        start = step * gait.period
        length = self._seen + gait.period
        seen = gait.seen(step)
        steps = [gait.step(step - 1), *(seen[step + i] for i in range(length // gait.period + 2))]
        c, s = math.cos(steps[1].yaw), math.sin(steps[1].yaw)  # the axes of the stance foot
        along = (c, s) if self.axis == 0 else (-s, c)
        stances = np.array([along[0] * step.x + along[1] * step.y for step in steps])
        velocity = np.diff(gait.region.centres(stances, length + 1)) / gait.config.tick
        tails = np.empty(gait.period)
        for phase in range(gait.period):
            weights = self.setting.divergent.input_weights(start + phase, self._seen)[horizon:]
            tails[phase] = weights @ velocity[phase + horizon : phase + self._seen]
        return tails

    def relaxed(self) -> Term:
        other = copy(self)
        other.price = MISSED_TAIL
        return other
