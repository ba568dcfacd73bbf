"""People on the ground below a path: expected fatalities, the greatest density, targets and prices."""
