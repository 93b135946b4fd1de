"""Robots and meshes that users send: forms, archives, descriptions, checked before they are kept."""
