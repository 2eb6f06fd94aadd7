"""What a term of problem (36) is, and what it is given to write its rows and to fill its parameters."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple

import numpy as np

from pdhocbf_drake.barriers import AffineBarrier
from pdhocbf_drake.mpc.commanded import Commanded, CommandedSteps
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.plan import Plan
from pdhocbf_drake.mpc.terminal_set import TerminalSet
from pdhocbf_drake.mpc.terms.program import AxisProgram
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.divergent import DivergentComponent
from pdhocbf_drake.walking.vhip import Vhip


@dataclass(frozen=True)
class Setting:
    """What the terms of one axis are made from.

    Attributes:
        axis: 0 (x) or 1 (y).
        gait, vhip, divergent: the walk, its template and the divergent component of that.
        config: the periodic MPC.
        barriers: those on this axis.
        terminal: the terminal set (20f) of this axis, if there is one.
        commanded: the steps that the gait commands.
        turn: angle from a plan's start to its end, by which the periodic tail is turned [rad].
    """

    axis: int
    gait: Gait
    vhip: Vhip
    divergent: DivergentComponent
    config: MpcConfig
    barriers: tuple[AffineBarrier, ...]
    terminal: TerminalSet | None
    commanded: CommandedSteps
    turn: float = 0.0


class Tick(NamedTuple):
    """What θ is filled from at tick k, for both axes.

    Attributes:
        tick, step, phase: k = step · N + phase.
        state: [c, v, p] per axis, shape (2, 3) [m, m/s, m].
        stance: centres of the last and this step's box per axis, shape (2, 2) [m].
        here: the latter, as one number per axis [m].
        error: e_k = c + v/ω_k − p of each axis, see `DivergentComponent` [m].
        ahead: the steps commanded from this one on.
        bounds: V̄(k) … V̄(k + H) of each barrier by name, shape (H + 1,).
        zmp_offset: expected real minus template ZMP at k + 1 … k + H per axis, shape (2, H) [m]; None is zero.
        last: the plan of the tick before, if there is one.
    """

    tick: int
    step: int
    phase: int
    state: np.ndarray
    stance: np.ndarray
    here: list[float]
    error: tuple[float, float]
    ahead: Commanded
    bounds: Mapping[str, np.ndarray]
    zmp_offset: np.ndarray | None
    last: Plan | None


class RowKind(NamedTuple):
    """What holds for all rows of one name.

    Attributes:
        moves: at which instants the i-th row comes to be about what the (i + 1)-th was about: at every "tick", or at
            every new "step".
        is_bound: whether the rows become bounds by a linear change of variables, see `qp.daqp_solver.DaqpQp`.
        missed_as: the constraint by whose name a plan that misses the rows says so; empty where none can.
        unit: of the amount by which it is missed.
    """

    moves: Literal["tick", "step"]
    is_bound: bool = False
    missed_as: str = ""
    unit: str = "m"


class Term:
    """One term of problem (36) on one axis: a cost, constraints, or both.

    Attributes:
        rows: the names of its rows in the program.
        axes_alike: whether it writes the same on x and y, so that both axes can have one program.
        places: where its parameters lie in θ, set by the problem.
    """

    rows: ClassVar[Mapping[str, RowKind]] = {}
    axes_alike: ClassVar[bool] = False

    def __init__(self, setting: Setting) -> None:
        self.setting, self.axis = setting, setting.axis
        self.places: Mapping[str, slice] = {}

    @classmethod
    def configured(cls, config: MpcConfig) -> bool:
        """Whether a problem with this config can have such a term."""
        return True

    @classmethod
    def of(cls, setting: Setting) -> list[Term]:
        """The terms of this kind in a problem: none, one, or one for each barrier."""
        return [cls(setting)] if cls.configured(setting.config) else []

    @property
    def row_kinds(self) -> Mapping[str, RowKind]:
        """`rows`, where their names depend on the term's own name."""
        return self.rows

    @property
    def sizes(self) -> dict[str, int]:
        """Its parameters in θ by name."""
        return {}

    @property
    def slacks(self) -> int:
        """How many slack variables it adds to the decisions where it is soft."""
        return 0

    @property
    def period(self) -> int:
        """After how many ticks its rows repeat: a divisor of a step, or a gait where the two steps of one differ."""
        return 1

    @property
    def key(self) -> Hashable:
        """What its rows depend on besides gait, template and config, so that equal problems are compiled once."""
        return type(self), None if self.axes_alike else self.axis

    def write(self, program: AxisProgram) -> None:
        """Adds its cost and rows for ticks with the program's phase."""
        raise NotImplementedError

    def fill_step(self, step: int, ahead: Commanded, theta: np.ndarray) -> None:
        """Fills in what holds all through step j; θ is zero before."""

    def fill_tick(self, tick: Tick, theta: np.ndarray) -> None:
        """Fills in what a tick changes."""

    def softened(self) -> Term:
        """The same term where barriers are softened (second rung of the ladder)."""
        return self

    def relaxed(self) -> Term:
        """The same term where no particular end is demanded of a plan (third rung of the ladder)."""
        return self
