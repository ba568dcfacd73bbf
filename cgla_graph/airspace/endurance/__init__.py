"""Time and energy of a flight in the wind, and whether a battery lasts."""
