"""Second opinions: they share nothing with what they check."""
