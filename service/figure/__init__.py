"""The floor plan of a layout, drawn with matplotlib, which no other room loads."""
