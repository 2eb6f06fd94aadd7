"""Certified sets of the walking template: enforceable bounds, their cost, and the largest admissible pushes."""
