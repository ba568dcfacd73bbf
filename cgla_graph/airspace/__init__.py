"""Airspace: zones of authorities, plans of flights, and one checked against the other."""
