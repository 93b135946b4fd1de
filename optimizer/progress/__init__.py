"""How far a solve is, for whoever waits for it: stages and time left, and the best layout so far."""
