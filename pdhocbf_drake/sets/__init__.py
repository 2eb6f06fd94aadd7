"""Convex polytopes and controlled invariant sets of periodic linear systems."""

from pdhocbf_drake.sets.invariant_set import InvariantSet, broken_phases, invariant_set, predecessor_rows
from pdhocbf_drake.sets.polytope import Polytope

__all__ = ["InvariantSet", "Polytope", "broken_phases", "invariant_set", "predecessor_rows"]
