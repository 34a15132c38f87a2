"""The figures of a diagnosis. Their names alone are here: a diagnosis without figures starts
without matplotlib."""

FIGURES = ("decision", "verdict", "error-budget", "simulation", "dependence")
"""Names of their files."""
