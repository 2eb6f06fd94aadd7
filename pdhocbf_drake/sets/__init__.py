"""Convex polytopes and controlled invariant sets of periodic linear systems."""
