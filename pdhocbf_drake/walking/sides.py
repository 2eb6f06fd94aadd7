"""Which foot stands."""

LEFT, BOTH, RIGHT = 1, 0, -1
