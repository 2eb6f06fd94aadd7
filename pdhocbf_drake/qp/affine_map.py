"""Affine maps and quadratic forms of the parameters θ, stored without their zeros."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.qp.kernels import Affine, Columns, Quadratic, Sparse, quadratic_value, write_affine


def compressed(matrix: np.ndarray) -> Sparse:
    """A dense matrix in compressed rows."""
    flat = np.ascontiguousarray(matrix).ravel()
    places = np.flatnonzero(flat != 0.0)  # several times as fast as `np.nonzero(matrix)`
    starts = np.searchsorted(places, matrix.shape[1] * np.arange(len(matrix) + 1))
    columns = places % max(matrix.shape[1], 1)
    return starts.astype(np.int32), columns.astype(np.int32), flat[places]


def by_columns(matrix: np.ndarray) -> Columns:
    """A dense matrix by columns, each from its first to its last entry that is not zero."""
    used = matrix.T != 0.0
    begun = np.logical_or.accumulate(used, axis=1)
    kept = begun & np.logical_or.accumulate(used[:, ::-1], axis=1)[:, ::-1]
    starts = np.concatenate([[0], np.cumsum(kept.sum(axis=1))])
    firsts = used.shape[1] - begun.sum(axis=1)
    return starts.astype(np.int32), firsts.astype(np.int32), matrix.T[kept]


def generic_point(count: int) -> np.ndarray:
    """A point of R^count at which two different linear functions differ, except by chance, shape (count,)."""
    return np.sin(np.arange(1.0, count + 1.0) ** 2)


class AffineMap:
    """b(θ) = offset + M θ, with M in compressed rows.

    In a program over a horizon most parameters enter a few rows only: a dense M of 80 samples has 40,000
    coefficients, of which 3,000 are not zero.

    Attributes:
        offset: shape (m,).
        parameters: the length of θ, which is the number of columns of M.
        changing: which rows of b depend on θ, shape (m,).
        arrays: offset and M for the kernels.
    """

    def __init__(self, offset: np.ndarray, matrix: np.ndarray) -> None:
        self._set(np.array(offset, dtype=float), matrix.shape[1], compressed(matrix))

    def _set(self, offset: np.ndarray, parameters: int, sparse: Sparse) -> AffineMap:
        self.offset, self.parameters = offset, parameters
        self.changing = np.diff(sparse[0]) > 0
        self.arrays: Affine = (offset, *sparse)
        return self

    def __len__(self) -> int:
        return len(self.offset)

    def __call__(self, theta: np.ndarray) -> np.ndarray:
        """b(θ), shape (m,).

        Raises:
            InputError: θ has another shape than (parameters,).
        """
        check_parameters(theta, self.parameters)
        b = np.empty(len(self.offset))
        write_affine(*self.arrays, theta, b)
        return b

    def rows(self, chosen: np.ndarray) -> AffineMap:
        """The map of the rows with the given indices, in that order."""
        offset, starts, columns, values = self.arrays
        counts = np.diff(starts)[chosen]
        stops = np.cumsum(counts)
        at = np.repeat(starts[chosen] - (stops - counts), counts) + np.arange(counts.sum())
        new = np.concatenate([[0], stops]).astype(np.int32)
        return AffineMap.__new__(AffineMap)._set(offset[chosen], self.parameters, (new, columns[at], values[at]))

    def stacked(self, other: AffineMap) -> AffineMap:
        """The map of these rows followed by those of another map of the same θ."""
        (offset, starts, columns, values), (offset_2, starts_2, columns_2, values_2) = self.arrays, other.arrays
        sparse = (
            np.concatenate([starts, starts[-1] + starts_2[1:]]),
            np.concatenate([columns, columns_2]),
            np.concatenate([values, values_2]),
        )
        return AffineMap.__new__(AffineMap)._set(np.concatenate([offset, offset_2]), self.parameters, sparse)

    @property
    def matrix(self) -> np.ndarray:
        """M, shape (m, parameters)."""
        _, starts, columns, values = self.arrays
        matrix = np.zeros((len(self.offset), self.parameters))
        matrix[np.repeat(np.arange(len(matrix)), np.diff(starts)), columns] = values
        return matrix


class QuadraticForm:
    """V(θ) = ½ θᵀR θ + rᵀθ + c, evaluated on the coefficients that are not zero.

    Attributes:
        parameters: the length of θ.
        arrays: c, r and R for the kernels.
    """

    def __init__(self, matrix: np.ndarray, vector: np.ndarray, constant: float) -> None:
        self.parameters = len(vector)
        used = np.flatnonzero(matrix.any(axis=1) | (vector != 0.0)).astype(np.int32)
        slopes = AffineMap(vector[used], 0.5 * matrix[used])
        self.arrays: Quadratic = (float(constant), used, *slopes.arrays)

    def __call__(self, theta: np.ndarray) -> float:
        """V(θ).

        Raises:
            InputError: θ has another shape than (parameters,).
        """
        check_parameters(theta, self.parameters)
        return float(quadratic_value(self.arrays, theta))


def check_parameters(theta: np.ndarray, count: int) -> None:
    """Refuses θ of another shape than (count,), beyond which machine code would read.

    Raises:
        InputError: with both shapes.
    """
    if theta.shape != (count,):
        raise InputError(f"θ must have shape ({count},), given {theta.shape}")
