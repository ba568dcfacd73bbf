"""Studies: comparisons that are files, whose runs are isolated, kept in a database and gone on with."""
