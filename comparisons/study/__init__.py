"""Studies: comparisons that are files, whose runs are isolated, kept as they end and gone on with."""
