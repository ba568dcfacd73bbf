"""Solvers that draw samples: PRM*, and OMPL's planners."""
