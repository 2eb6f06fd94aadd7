"""The programs of problem (36) for every phase of the step, compiled, each with its solver."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from pdhocbf_drake.barriers import AffineBarrier
from pdhocbf_drake.mpc.axis_program import BOUND_ROWS, axis_program
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.program_cache import Compiled, OnDemand, ProgramCache
from pdhocbf_drake.mpc.rungs import Rung, without_decay
from pdhocbf_drake.mpc.solution import Reason
from pdhocbf_drake.mpc.terminal_set import TerminalSet
from pdhocbf_drake.mpc.warm_start import guess_rows
from pdhocbf_drake.qp import ParametricQp, compile_program, make_solver
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.divergent import DivergentComponent
from pdhocbf_drake.walking.vhip import Vhip


@dataclass(frozen=True)
class Programs:
    """What the programs are made from; `axis_program` writes them.

    Attributes:
        barriers: of the axes x and y.
        terminal: terminal sets (20f) by axis.
    """

    gait: Gait
    vhip: Vhip
    divergent: DivergentComponent
    config: MpcConfig
    barriers: tuple[Sequence[AffineBarrier], Sequence[AffineBarrier]]
    terminal: Mapping[int, TerminalSet]

    def rungs(self, qps: Sequence[Sequence[ParametricQp]]) -> list[Rung]:
        """What is solved where the scenario's own problem (`qps`) has no solution, see `mpc.rungs`."""
        own = Rung(Reason.CROSS_SOLVED, lambda axis, phase: qps[axis][phase], "clarabel")
        soft = self.config.model_copy(update={"barrier": "soft"})
        hard = self.config.barrier == "hard" and any(self.barriers)
        softened = [Rung(Reason.SOFTENED, partial(self.compile, config=soft), self.config.solver)] if hard else []
        relaxed = Rung(Reason.RELAXED, partial(self.compile, config=soft, elastic=True), self.config.solver)
        return [own, *softened, relaxed]

    def compiled(self, axis: int, cache: ProgramCache) -> Compiled:
        """The programs of one axis; they depend on the axis by its barriers and terminal set alone."""
        barriers, terminal = self.barriers[axis], self.terminal.get(axis)
        written = self.config.model_dump_json(exclude={"recovery"})
        matrices = (self.gait.box_weight.tobytes(), self.vhip.A.tobytes(), self.vhip.B.tobytes())
        key = (written, matrices, tuple(map(id, barriers)), id(terminal))
        return cache.get(key, (tuple(barriers), terminal), lambda: self._make(axis))

    def _make(self, axis: int) -> Compiled:
        count, solver = self.gait.period, self.config.solver
        qps = OnDemand(count, lambda phase: self.compile(axis, phase))
        solvers = OnDemand(count, lambda phase: make_solver(solver, qps[phase], BOUND_ROWS, guess_rows(qps, phase)))
        return Compiled(qps, solvers)

    def compile(self, axis: int, phase: int, config: MpcConfig | None = None, elastic: bool = False) -> ParametricQp:
        """One phase, of this problem or of one with another config; an elastic one demands no particular end."""
        barriers = without_decay(self.barriers[axis]) if elastic else self.barriers[axis]
        program = axis_program(
            self.gait, self.vhip, self.divergent, barriers, config or self.config, phase,
            self.terminal.get(axis), elastic,
        )  # fmt: skip
        return compile_program(program.prog, program.decisions, program.parameters)
