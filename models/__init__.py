"""What robots and cells are: kinematics, geometry, catalogue, tasks. Nothing here searches or answers requests."""
