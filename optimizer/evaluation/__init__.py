"""A given layout, scored and verified: what each arm can do from its base, and what the arms can do together."""
