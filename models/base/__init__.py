"""What everything else is made of: arrays, errors, poses, tolerances, evenly spread points."""
