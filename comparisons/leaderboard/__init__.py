"""Rankings of a study's solvers, their performance over time, and changes between versions."""
