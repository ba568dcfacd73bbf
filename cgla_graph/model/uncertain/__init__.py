"""Risk that is not known exactly: scenarios, their weighted sums, and means of the worst costs."""
