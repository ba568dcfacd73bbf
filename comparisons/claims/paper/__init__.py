"""The claims of the paper, topic by topic: what they say, what is measured, and the verdict's rule."""
