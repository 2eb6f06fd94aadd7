"""The moving ZMP box, eq. (27)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from pdhocbf_drake.mpc.commanded import Commanded
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.terms.program import AxisProgram
from pdhocbf_drake.mpc.terms.term import RowKind, Term


class ZmpBox(Term):
    """|p(k+i) + offset_i − S_i feet| ≤ S_i half, i = 1 … H, eq. (27).

    S_i feet is the centre of the box at k + i, which moves from foot to foot in double support, and S_i half its half
    side. The offset is by how much the real ZMP is expected to differ from the template's.

    Parameters: half (n_f + 2,), half sides in the last, this and the coming steps, less `mpc.zmp_margin` [m].

    Attributes:
        cuts: parameters by which a side is cut at each tick, by the name of its rows.
    """

    rows: ClassVar = {
        "zmp_box_lower": RowKind("tick", is_bound=True, missed_as="zmp_box"),
        "zmp_box_upper": RowKind("tick", is_bound=True, missed_as="zmp_box"),
    }
    axes_alike = True
    cuts: ClassVar[Mapping[str, str]] = {}

    @classmethod
    def configured(cls, config: MpcConfig) -> bool:
        return not config.holds_zmp

    @property
    def sizes(self) -> dict[str, int]:
        return {"half": self.setting.config.horizon // self.setting.gait.period + 2}

    def write(self, program: AxisProgram) -> None:
        part, eye, gait = program.part, np.eye(program.horizon), self.setting.gait
        variables = np.concatenate([program.u, part["state"], program.feet, part["half"], part["zmp_offset"]])
        sides = gait.region.rows(program.phase, program.horizon, len(program.f))
        for name, (sign, on_feet, on_half) in zip(self.rows, sides, strict=True):
            zmp = np.hstack([sign * program.gamma[1:, 2], sign * program.phi[1:, 2]])
            cut = [program.part[self.cuts[name]]] if name in self.cuts else []
            rows = np.hstack([zmp, on_feet, on_half, sign * eye, *([-eye] * len(cut))])
            program.at_least(rows, np.concatenate([variables, *cut]), name)

    def fill_step(self, step: int, ahead: Commanded, theta: np.ndarray) -> None:
        theta[self.places["half"]] = ahead.half[self.axis]
