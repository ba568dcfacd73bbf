"""The figures and tables of the report: those of the paper, remade, and ours."""
