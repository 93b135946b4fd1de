"""Following a solve from outside, and stopping it."""
