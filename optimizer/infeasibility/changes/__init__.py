"""Changes of a request by one number, for everything that a conflict may name, the cheapest first."""
