"""The search of an arm whose poses leave something open: a free roll, a cone, ranges of position and rotation."""
