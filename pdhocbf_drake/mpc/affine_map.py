"""Affine maps of the parameters, kept without their zeros, since they run at every tick."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.mpc.kernels import Affine, write_affine


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
        self.offset = np.array(offset, dtype=float)
        self.parameters = matrix.shape[1]
        flat = np.ascontiguousarray(matrix).ravel()
        places = np.flatnonzero(flat != 0.0)  # several times as fast as the `nonzero` of a matrix of floats
        starts = np.searchsorted(places, self.parameters * np.arange(len(matrix) + 1))
        self.changing = np.diff(starts) > 0
        columns = places % max(self.parameters, 1)
        self.arrays: Affine = (self.offset, starts.astype(np.int32), columns.astype(np.int32), flat[places])

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

    @property
    def matrix(self) -> np.ndarray:
        """M, shape (m, n_θ)."""
        _, starts, columns, values = self.arrays
        matrix = np.zeros((len(self.offset), self.parameters))
        matrix[np.repeat(np.arange(len(matrix)), np.diff(starts)), columns] = values
        return matrix
