"""Scenarios, their diagrams and simulations, and the logs and folders of their runs."""
