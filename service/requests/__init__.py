"""From a body to a cell, or to everything that is wrong with it."""
