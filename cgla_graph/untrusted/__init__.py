"""Bounded readers for untrusted text, JSON, XML, KML and KMZ files."""
