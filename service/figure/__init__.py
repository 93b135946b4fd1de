"""The floor plan of a layout."""
