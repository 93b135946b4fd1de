"""What comes out: layouts and what was found out about them, free of any engine's types."""
