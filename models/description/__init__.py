"""Robot descriptions in URDF: their tree of links, and which chain of it is the arm."""
