"""Metrics, figures, replay and report of a run, all made from its log."""
