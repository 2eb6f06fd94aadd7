"""Robots read from their models: a safe copy of the model, and the robot file with all that the geometry says."""
