"""Solvers that search the geometry of threats and areas: visibility graphs, Voronoi diagrams, elastic chains."""
