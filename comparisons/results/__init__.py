"""Results of a study looked up: tables, filters, what changed since another one, one run again, exports."""
