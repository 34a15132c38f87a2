"""The steps of an experiment: which file comes from which, which are up to date, make's rules."""
