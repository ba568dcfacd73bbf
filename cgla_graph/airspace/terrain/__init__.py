"""Terrain: where it closes the map to a flight, how high a plan is above it, and plans that follow it."""
