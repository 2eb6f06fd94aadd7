"""Periodic discrete-time high-order control barrier functions, for any periodic discrete-time system.

A barrier is h(k, x) with a period and its class-K functions; an `AffineBarrier` is h = ±(V̄(k) − n_k·x). It can be
evaluated (`psi`), checked (`check_relative_degree`, `check_in_safe_set`, `feasible_width`), enforced (`BarrierFilter`,
`add_barrier_rows`, `add_nonlinear_barrier_rows`) and measured along a log (`record`).
"""

from typing import TYPE_CHECKING

from pdhocbf_drake.lazy import lazy_names

if TYPE_CHECKING:
    from pdhocbf_drake.barriers.barrier import AffineBarrier, Barrier, make_barrier
    from pdhocbf_drake.barriers.bounds import Bound, constant, harmonic, make_bound, tabulated
    from pdhocbf_drake.barriers.class_k import ClassK, Linear, Saturating, check_class_k
    from pdhocbf_drake.barriers.config import BarrierConfig, BoundConfig
    from pdhocbf_drake.barriers.dynamics import PeriodicAffineSystem, PeriodicSystem, rollout
    from pdhocbf_drake.barriers.filter import BarrierFilter, FilterResult
    from pdhocbf_drake.barriers.margin import BarrierRecord, margin_ratio, record, record_from_h, safety_margin
    from pdhocbf_drake.barriers.nonlinear import add_dynamics, add_nonlinear_barrier_rows
    from pdhocbf_drake.barriers.nonlinear_filter import NonlinearFilter
    from pdhocbf_drake.barriers.recursion import psi, psi_along, psi_coefficients, psi_from_h
    from pdhocbf_drake.barriers.relative_degree import check_relative_degree, enforced_psi, relative_degree
    from pdhocbf_drake.barriers.rows import Rows, add_barrier_rows, affine_rows
    from pdhocbf_drake.barriers.safe_set import (
        WorstCase,
        check_in_safe_set,
        feasible_width,
        in_safe_set,
        initial_psi,
        input_interval,
    )
    from pdhocbf_drake.barriers.uncertainty import robust_barrier

__all__ = [
    "AffineBarrier", "Barrier", "BarrierConfig", "BarrierFilter", "BarrierRecord", "Bound", "BoundConfig", "ClassK",
    "FilterResult", "Linear", "NonlinearFilter", "PeriodicAffineSystem", "PeriodicSystem", "Rows", "Saturating",
    "WorstCase", "add_barrier_rows", "add_dynamics", "add_nonlinear_barrier_rows", "affine_rows", "check_class_k",
    "check_in_safe_set", "check_relative_degree", "constant", "enforced_psi", "feasible_width", "harmonic",
    "in_safe_set", "initial_psi", "input_interval", "make_barrier", "make_bound", "margin_ratio", "psi", "psi_along",
    "psi_coefficients", "psi_from_h", "record", "record_from_h", "relative_degree", "robust_barrier", "rollout",
    "safety_margin", "tabulated",
]  # fmt: skip

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "barrier": ("AffineBarrier", "Barrier", "make_barrier"),
        "bounds": ("Bound", "constant", "harmonic", "make_bound", "tabulated"),
        "class_k": ("ClassK", "Linear", "Saturating", "check_class_k"),
        "config": ("BarrierConfig", "BoundConfig"),
        "dynamics": ("PeriodicAffineSystem", "PeriodicSystem", "rollout"),
        "filter": ("BarrierFilter", "FilterResult"),
        "margin": ("BarrierRecord", "margin_ratio", "record", "record_from_h", "safety_margin"),
        "nonlinear": ("add_dynamics", "add_nonlinear_barrier_rows"),
        "nonlinear_filter": ("NonlinearFilter",),
        "recursion": ("psi", "psi_along", "psi_coefficients", "psi_from_h"),
        "relative_degree": ("check_relative_degree", "enforced_psi", "relative_degree"),
        "rows": ("Rows", "add_barrier_rows", "affine_rows"),
        "safe_set": (
            "WorstCase",
            "check_in_safe_set",
            "feasible_width",
            "in_safe_set",
            "initial_psi",
            "input_interval",
        ),
        "uncertainty": ("robust_barrier",),
    },
)
