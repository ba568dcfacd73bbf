"""What is planned over, asked and answered: risk, areas, graphs, problems, solutions, and what a solver is."""
