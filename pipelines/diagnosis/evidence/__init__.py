"""What the decision is made from: runs behind filters, their noise, and how the residual
repeats."""
