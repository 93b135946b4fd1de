"""Forward and inverse kinematics of one arm, by Pinocchio, NumPy and CasADi."""
