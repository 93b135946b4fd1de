"""One arm: its kinematic chain and limits, its postures, and how it is set up in a cell."""
