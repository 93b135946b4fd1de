"""What everything else is made of: arrays, errors, poses, tolerances, spread points."""
