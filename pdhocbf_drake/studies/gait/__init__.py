"""What the shape of a gait costs: joint torques, ZMP, barrier, pushes and certified area over the gait's parameters."""
