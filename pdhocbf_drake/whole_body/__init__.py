"""The last layer: joint accelerations and ground wrenches within the limits of joints and soles.

Where the closed form of inverse kinematics and dynamics leaves a limit, a quadratic program (`program`) finds the
nearest motion that keeps it; height, torso and swing foot give way, and come back (`deviation`).
"""
