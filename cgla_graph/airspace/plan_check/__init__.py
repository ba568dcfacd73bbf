"""Check of a flight plan: legs, crossings, heights, and a proven bracket of the least cost of a clean plan."""
