"""One arm's cost as a function of its base position alone, and searches on it."""
