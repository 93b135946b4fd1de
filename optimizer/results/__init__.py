"""What comes out: layouts and what was found out about them, as plain data without types of any engine."""
