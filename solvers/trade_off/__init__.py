"""Length against risk: all paths that some k asks for, and the best within a budget."""
