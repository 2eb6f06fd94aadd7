"""Affine maps of the parameters, kept without their zeros, since they run at every tick."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.qp.kernels import Affine, Sparse, write_affine


def compressed(matrix: np.ndarray) -> Sparse:
    """A dense matrix without its zeros."""
    flat = np.ascontiguousarray(matrix).ravel()
    places = np.flatnonzero(flat != 0.0)  # several times as fast as the `nonzero` of a matrix of floats
    starts = np.searchsorted(places, matrix.shape[1] * np.arange(len(matrix) + 1))
    columns = places % max(matrix.shape[1], 1)
    return starts.astype(np.int32), columns.astype(np.int32), flat[places]


class AffineMap:
    """b(θ) = offset + M θ, with M in compressed rows.

    In a program over a horizon the state enters every row, a sample of a bound only two or three: the dense M of
    80 ticks has 40,000 coefficients, of which 3,000 are not zero.

    Attributes:
        offset: the constant part, shape (m,).
        parameters: number of columns of M.
        changing: which rows of b depend on θ at all, shape (m,).
        arrays: offset, and M in compressed rows.
    """

    def __init__(self, offset: np.ndarray, matrix: np.ndarray) -> None:
        self._keep(np.array(offset, dtype=float), matrix.shape[1], compressed(matrix))

    def _keep(self, offset: np.ndarray, parameters: int, sparse: Sparse) -> None:
        self.offset, self.parameters = offset, parameters
        self.changing = np.diff(sparse[0]) > 0
        self.arrays: Affine = (offset, *sparse)

    def __len__(self) -> int:
        return len(self.offset)

    def __call__(self, theta: np.ndarray) -> np.ndarray:
        """b(θ), shape (m,).

        Raises:
            ValueError: θ is of another length.
        """
        if theta.shape != (self.parameters,):  # machine code would read beyond it
            raise ValueError(f"θ must have shape ({self.parameters},), given {theta.shape}")
        b = np.empty(len(self.offset))
        write_affine(*self.arrays, theta, b)
        return b

    def rows(self, chosen: np.ndarray) -> AffineMap:
        """The map of the chosen rows, given by their numbers, in that order."""
        offset, starts, columns, values = self.arrays
        counts = np.diff(starts)[chosen]
        stops = np.cumsum(counts)
        at = np.repeat(starts[chosen] - (stops - counts), counts) + np.arange(counts.sum())
        new = np.concatenate([[0], stops]).astype(np.int32)
        return AffineMap._of(offset[chosen], self.parameters, (new, columns[at], values[at]))

    def above(self, other: AffineMap) -> AffineMap:
        """The map of these rows and then those of another one of the same θ."""
        (_, *mine), (_, *below) = self.arrays, other.arrays
        starts = np.concatenate([mine[0], mine[0][-1] + below[0][1:]])
        sparse = (starts, np.concatenate([mine[1], below[1]]), np.concatenate([mine[2], below[2]]))
        return AffineMap._of(np.concatenate([self.offset, other.offset]), self.parameters, sparse)

    @classmethod
    def _of(cls, offset: np.ndarray, parameters: int, sparse: Sparse) -> AffineMap:
        made = cls.__new__(cls)
        made._keep(offset, parameters, sparse)
        return made

    @property
    def matrix(self) -> np.ndarray:
        """M, shape (m, n_θ)."""
        _, starts, columns, values = self.arrays
        matrix = np.zeros((len(self.offset), self.parameters))
        matrix[np.repeat(np.arange(len(matrix)), np.diff(starts)), columns] = values
        return matrix
