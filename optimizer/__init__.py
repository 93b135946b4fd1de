"""Where the arms of a cell should stand, and what can be proved about it."""
