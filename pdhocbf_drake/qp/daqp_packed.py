"""A program and DAQP's memory for it as three arrays, which a kernel solves in one call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from pdhocbf_drake.qp import kernels
from pdhocbf_drake.qp.daqp_form import DaqpForm, soft_weights, wide_limits
from pdhocbf_drake.qp.daqp_library import FLAG, WORDS, Workspace


class PackedQp:
    """All that `kernels.solve_packed` reads and writes for one program.

    A program is 37 arrays. One behind the other they are in the cache when they are needed, and a call from Python
    hands over three.

    Attributes:
        arrays: the real numbers, the integers without their signs, and where each array lies among them, see
            `kernels`.
        workspace: DAQP's memory.

    Args:
        reals, integers, places: these arrays, taken over, with anything where a solve writes.
        hessian, rows: those of `DaqpForm`.
    """

    def __init__(
        self, reals: np.ndarray, integers: np.ndarray, places: np.ndarray, hessian: np.ndarray, rows: np.ndarray
    ) -> None:
        self._hessian, self._rows = hessian, rows
        self.arrays = reals, integers.view(np.uint32), places  # an index that can't be negative is not looked at twice
        senses, softened = (integers[slice(*places[name : name + 2])] for name in (kernels.SENSES, kernels.SOFTENED))
        low, high = np.split(self._own(kernels.LIMITS), 2)
        high[:] = wide_limits(senses)
        low[:] = -high
        self.workspace = Workspace(
            integers[:WORDS], hessian, rows, high, low, senses, self._own(kernels.Y), self._own(kernels.MULTIPLIERS)
        )
        places[:4] = *self.workspace.addresses, FLAG
        if self.workspace.flag >= 0 and len(softened):
            costs = self._own(kernels.SLACK_LINEAR), self._own(kernels.SLACK_QUADRATIC)
            self.workspace.soften(*soft_weights(len(senses), softened, *costs))

    @classmethod
    def of_form(cls, form: DaqpForm, guess_from: np.ndarray) -> PackedQp:
        """A program in DAQP's coordinates.

        Args:
            form: the program.
            guess_from: for each row of the form the place of its flag in a guess, (m,).
        """
        gradient, bounds, root, rows, (constant, used, *slopes) = form.to_limits
        _, inverse, hard, order = form.to_decisions
        _, softened, columns, linear, quadratic = form.to_slacks
        n, m = np.zeros(len(hard)), np.zeros(len(order))
        reals, real_places = _joined(
            [
                gradient[0], gradient[3], bounds[0], bounds[3], root[2], rows[2], np.array([constant]), slopes[0],
                slopes[3], inverse[2], linear, quadratic, n, n, np.zeros(len(form.rows)), bounds[0], n, m,
            ]
        )  # fmt: skip
        integers, integer_places = _joined(
            [
                np.zeros(WORDS, dtype=np.int32), *gradient[1:3], *bounds[1:3], *root[:2], *rows[:2], used,
                *slopes[1:3], *inverse[:2], hard, order, softened, columns, guess_from, form.senses, form.senses,
            ]
        )  # fmt: skip
        places = np.concatenate([np.zeros(4, dtype=np.int64), real_places, integer_places])
        return cls(reals, integers, places, form.hessian, form.rows)

    def constants(self) -> dict[str, np.ndarray]:
        """What no solve changes, from which `of_constants` makes an equal program."""
        reals, integers, places = self.arrays
        return {
            "reals": reals[: places[kernels.OPTIMUM]],
            "integers": integers[WORDS : places[kernels.SENSES]].view(np.int32),
            "places": np.concatenate([np.zeros(4, dtype=np.int64), places[4:]]),
            "hessian": self._hessian,
            "rows": self._rows,
        }

    @classmethod
    def of_constants(cls, kept: Mapping[str, np.ndarray]) -> PackedQp:
        """A program from its constants, which are copied."""
        places = kept["places"].copy()
        reals = np.zeros(places[kernels.MULTIPLIERS + 1])
        reals[: places[kernels.OPTIMUM]] = kept["reals"]
        integers = np.zeros(places[kernels.SENSES + 1], dtype=np.int32)
        integers[WORDS : places[kernels.SENSES]] = kept["integers"]
        cold, senses = (slice(*places[name : name + 2]) for name in (kernels.COLD, kernels.SENSES))
        integers[senses] = integers[cold]
        return cls(reals, integers, places, kept["hessian"], kept["rows"])

    def _own(self, name: int) -> np.ndarray:
        reals, _, places = self.arrays
        return reals[slice(*places[name : name + 2])]


def _joined(arrays: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """The arrays as one, of the type of the first, and where each begins and ends."""
    stops = np.cumsum([len(array) for array in arrays])
    places = np.stack([stops - [len(array) for array in arrays], stops], axis=1)
    return np.concatenate(arrays, dtype=arrays[0].dtype, casting="same_kind"), places.ravel()
