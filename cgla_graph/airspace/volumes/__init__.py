"""Volumes around a flight: flight geography, contingency volume, ground risk buffer, and the people below them."""
