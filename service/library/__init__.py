"""Robots and meshes that users brought, kept as files, beside the robots of the catalogue."""
