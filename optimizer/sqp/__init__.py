"""Sequential quadratic programming over whole layouts, until they keep every distance at and between their poses."""
