"""Default values that fit a robot's size, strength and soles, and a preview of its steps."""
