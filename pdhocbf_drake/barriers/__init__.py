"""Periodic discrete-time high-order control barrier functions, for any periodic discrete-time system."""

from pdhocbf_drake.barriers.barrier import AffineBarrier, Barrier, make_barrier
from pdhocbf_drake.barriers.bounds import Bound, constant, harmonic, make_bound, tabulated
from pdhocbf_drake.barriers.class_k import ClassK, Linear, Saturating, check_class_k
from pdhocbf_drake.barriers.config import BarrierConfig, BoundConfig
from pdhocbf_drake.barriers.dynamics import PeriodicAffineSystem, PeriodicSystem, rollout
from pdhocbf_drake.barriers.recursion import psi, psi_along, psi_coefficients, psi_from_h
from pdhocbf_drake.barriers.rows import Rows, add_barrier_rows, affine_rows

__all__ = [
    "AffineBarrier", "Barrier", "BarrierConfig", "Bound", "BoundConfig", "ClassK", "Linear", "PeriodicAffineSystem",
    "PeriodicSystem", "Rows", "Saturating", "add_barrier_rows", "affine_rows", "check_class_k", "constant", "harmonic",
    "make_barrier", "make_bound", "psi", "psi_along", "psi_coefficients", "psi_from_h", "rollout", "tabulated",
]  # fmt: skip
