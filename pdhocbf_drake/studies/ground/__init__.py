"""Walks over ground that is not flat, on the map and not: what they reach beside what they must."""
