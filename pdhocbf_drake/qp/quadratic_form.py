"""The part of a quadratic program's cost that no decision changes."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.qp.affine_map import AffineMap
from pdhocbf_drake.qp.kernels import Quadratic, quadratic


class QuadraticForm:
    """V(θ) = ½ θᵀR θ + rᵀθ + c, evaluated on the few coefficients that are not zero.

    Attributes:
        parameters: length of θ. arrays: see `kernels.Quadratic`.
    """

    def __init__(self, matrix: np.ndarray, vector: np.ndarray, constant: float) -> None:
        self.parameters = len(vector)
        used = np.flatnonzero(matrix.any(axis=1) | (vector != 0.0)).astype(np.int32)
        slopes = AffineMap(vector[used], 0.5 * matrix[used])
        self.arrays: Quadratic = (float(constant), used, *slopes.arrays)

    def __call__(self, theta: np.ndarray) -> float:
        """V(θ).

        Raises:
            ValueError: θ is of another length.
        """
        if theta.shape != (self.parameters,):  # machine code would read beyond it
            raise ValueError(f"θ must have shape ({self.parameters},), given {theta.shape}")
        return float(quadratic(self.arrays, theta))
