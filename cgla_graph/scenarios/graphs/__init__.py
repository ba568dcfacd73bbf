"""Graphs in files: their formats, and pairs of their nodes as scenarios."""
