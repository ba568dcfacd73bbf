"""Bend a path in the plane until it is a local optimum."""
