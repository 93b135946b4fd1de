"""What there is: robots, cells, their geometry and kinematics."""
