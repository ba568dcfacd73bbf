"""A page on loopback where threats, ends and areas are dragged, and the path and its proof follow."""
