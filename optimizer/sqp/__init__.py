"""Sequential quadratic programming over whole layouts: the programs that are solved on the way to a clean optimum."""
