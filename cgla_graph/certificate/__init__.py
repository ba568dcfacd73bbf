"""Proven lower bounds of the cost of every path."""
