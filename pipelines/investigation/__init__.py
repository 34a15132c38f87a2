"""The experiment that decides between causes that a verdict leaves open."""
