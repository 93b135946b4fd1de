"""What a layout is to be best at: measures of a path, by name, and their weighted sum."""
