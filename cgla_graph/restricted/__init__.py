"""The optimum of a complete lattice graph of any size: the cost matrix, restricted to what can be part of it."""
