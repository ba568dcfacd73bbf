"""Intervals, paired tests and ranks that need no distribution."""
