"""The report: one page with the results of the other stages, computed from their files only."""
