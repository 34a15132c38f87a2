"""Charts: one model, drawn by uPlot in a page and by matplotlib in a file."""
