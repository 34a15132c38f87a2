"""The basis of the decision: filtered runs, their noise, and how the residual repeats."""
