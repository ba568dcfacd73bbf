"""Scheduling of isolated calls: a pool of worker processes, a Dask cluster, and tasks that need each other."""
