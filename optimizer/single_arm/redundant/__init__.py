"""The search of arms without a reduced problem: seven joints, an offset wrist, or a tilted first axis."""
