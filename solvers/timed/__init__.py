"""Paths through risk that moves: a planner in space and time, an exact lattice, and their peers."""
