"""Check of a flight plan: legs, crossings, heights, and a proven bracket of how much better any plan could be."""
