"""Affine maps that know which of their coefficients matter, since they run at every tick."""

from __future__ import annotations

import numpy as np

_FEW = 8  # a column with at most this many entries (or one row in sixteen) is kept as single entries


class AffineMap:
    """b(θ) = offset + M θ, with M split into its full columns (one dense product) and the few entries of the others.

    In a program over a horizon the state enters every row, a sample of a bound only two or three: the dense M of
    80 ticks has 40,000 coefficients, of which 3,000 are not zero.

    Attributes:
        offset: the constant part, shape (m,).
        parameters: number of columns of M.
        changing: which rows of b depend on θ at all, shape (m,).
    """

    def __init__(self, offset: np.ndarray, matrix: np.ndarray) -> None:
        self.offset = np.array(offset, dtype=float)
        self.parameters = matrix.shape[1]
        nonzero = matrix != 0.0
        self.changing = nonzero.any(axis=1)
        changing = np.flatnonzero(self.changing)
        first, stop = (int(changing[0]), int(changing[-1]) + 1) if len(changing) else (0, 0)
        self._rows = slice(first, stop)
        matrix, nonzero = matrix[self._rows], nonzero[self._rows]
        count = nonzero.sum(axis=0)
        self._full = _hull(np.flatnonzero(count > max(_FEW, len(matrix) // 16)))
        self._dense = np.ascontiguousarray(matrix[:, self._full])
        nonzero[:, self._full] = False
        rows, columns = np.nonzero(nonzero)
        per_row = nonzero.sum(axis=1)
        # The j-th single entry of each row stands in line j of these two tables, zeros where a row has fewer.
        line = np.arange(len(rows)) - (np.cumsum(per_row) - per_row)[rows]
        lines = int(per_row.max(initial=0))
        self._columns = np.zeros((lines, len(matrix)), dtype=np.intp)
        self._values = np.zeros((lines, len(matrix)))
        self._columns[line, rows] = columns
        self._values[line, rows] = matrix[rows, columns]
        self._shift = self.offset[self._rows]

    def __len__(self) -> int:
        return len(self.offset)

    def __call__(self, theta: np.ndarray) -> np.ndarray:
        """b(θ), shape (m,)."""
        b = self.offset.copy()
        self.write(theta, b)
        return b

    def write(self, theta: np.ndarray, out: np.ndarray) -> None:
        """Writes the rows of b(θ) that θ changes into `out`, shape (m,); the others are left as they are."""
        rows = out[self._rows]
        if self._dense.shape[1]:
            np.dot(self._dense, theta[self._full], out=rows)
            rows += self._shift
        else:
            rows[:] = self._shift
        if len(self._values):
            entries = theta.take(self._columns)
            entries *= self._values
            for line in entries:
                rows += line

    @property
    def matrix(self) -> np.ndarray:
        """M, shape (m, n_θ)."""
        matrix = np.zeros((len(self.offset), self.parameters))
        block = matrix[self._rows]
        block[:, self._full] = self._dense
        every = np.arange(len(block))
        for columns, values in zip(self._columns, self._values, strict=True):
            np.add.at(block, (every, columns), values)
        return matrix


def _hull(columns: np.ndarray) -> slice | np.ndarray:
    """A slice (which copies nothing) where the columns lie close together."""
    if len(columns) and columns[-1] - columns[0] < 2 * len(columns):
        return slice(int(columns[0]), int(columns[-1]) + 1)
    return columns
