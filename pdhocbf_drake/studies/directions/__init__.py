"""Walks that turn, go sideways, stop and start: what they reach beside what they must."""
