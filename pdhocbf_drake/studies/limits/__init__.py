"""Walks of robots that are too weak, too slow or on slippery ground, with the whole-body program and without."""
