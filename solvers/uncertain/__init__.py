"""Plans under uncertain risk: the expected cost, the mean of the worst costs, or the worst one, with proof."""
