"""Scenario in, run folder out: the wiring of every block into one diagram."""
