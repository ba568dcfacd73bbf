"""Curves that an aircraft can fly: straight lines and circular arcs, tangent everywhere, no tighter than a radius."""
