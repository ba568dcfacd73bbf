"""Calls that may crash, hang or eat memory, in a process of their own and within limits."""
