"""Parametric quadratic programs: written as a `MathematicalProgram`, compiled once, solved at every tick."""
