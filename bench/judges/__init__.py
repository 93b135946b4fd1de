"""Slow judges that share nothing with what they judge: every millimetre of a path, every pair of bodies."""
