"""The steps of an experiment: which file comes from which, what is up to date, rules for make."""
