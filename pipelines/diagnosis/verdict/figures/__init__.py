"""Name the figures of a diagnosis.

Only their names are here: a diagnosis without figures starts without matplotlib.
"""

FIGURES = ("decision", "verdict", "error-budget", "simulation", "dependence")
"""Names of their files."""
WITH_DETECTION_LINES = "detection-lines"
"""Name of the file that only motions with detection lines have."""
