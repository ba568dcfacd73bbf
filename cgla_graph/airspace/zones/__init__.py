"""Zones that authorities publish, as no-fly areas: what applies at an altitude and a time."""
