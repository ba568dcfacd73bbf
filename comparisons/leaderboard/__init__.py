"""What the runs of a study say of its solvers: who leads, how soon, how often, and what has changed."""
