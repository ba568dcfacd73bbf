"""Solvers that plan in the plane itself."""
