"""Zones that authorities publish, and the no-fly areas that they close at an altitude and a time."""
