"""Rigid-body kinematics and dynamics of a robot with revolute joints as machine code, from the data of its plant."""
