"""The work of an experiment: which file comes from which, what is up to date, and the same told to
make."""
