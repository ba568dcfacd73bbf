"""Solvers on a lattice of their own, whose points are joined with near ones only."""
