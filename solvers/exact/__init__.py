"""Solvers that find the optimum of any graph."""
