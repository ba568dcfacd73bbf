"""Readings of Eq. 5 for the knowledge of several UAVs, and searches under them."""
