"""One arm: its chain with limits, its named frames, its postures, and what it is set up with."""
