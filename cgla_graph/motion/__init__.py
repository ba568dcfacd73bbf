"""Trajectories and planning in space and time."""
