"""Default values that fit a robot's size, joints and soles, and checks of a robot's file and of its walk."""
