"""Continuous costs-to-go, marched over the cells of a mesh."""
