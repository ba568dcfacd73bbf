"""Rasters in files: what they hold, what stands beside them, where they lie, and their projection to metres."""
