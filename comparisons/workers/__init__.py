"""Calls in processes of their own, within hard limits, here or on a Dask cluster; nothing here knows of planners."""
