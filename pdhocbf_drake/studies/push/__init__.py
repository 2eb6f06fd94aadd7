"""How hard the robot can be pushed, and what a barrier changes about it."""
