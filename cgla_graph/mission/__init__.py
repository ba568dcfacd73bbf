"""UAVs that sense, share, replan and avoid each other, tick by tick."""
