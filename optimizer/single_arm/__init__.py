"""The search of one arm that nothing couples to others."""
