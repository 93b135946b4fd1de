"""What users brought: robots and meshes, kept as files, and the robots of the catalogue beside them."""
