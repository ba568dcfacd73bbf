"""Planning while the map changes: moving threats, areas with periods, wind, and the oracle of timed paths."""
